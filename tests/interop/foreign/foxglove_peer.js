// A node of @foxglove/ros1 (it knows no services) that uses minirospy and offers a topic. One JSON line for each thing
// that it saw. FULL_TEXT and MD5SUM are those of sensor_msgs/LaserScan, from minirospy's class. Ends with its input.
"use strict";

const { RosNode } = require("@foxglove/ros1");
const { getEnvVar, getHostname, getNetworkInterfaces, getPid, TcpServerNode, TcpSocketNode } = require("@foxglove/ros1/nodejs");
const { parse } = require("@foxglove/rosmsg");
const { HttpServerNodejs } = require("@foxglove/xmlrpc/nodejs");

const say = (what, value) => process.stdout.write(JSON.stringify({ what, value }) + "\n");
process.on("unhandledRejection", (error) => say("error", String(error && error.stack)));

async function main() {
  const hostname = RosNode.GetRosHostname(getEnvVar, getHostname, getNetworkInterfaces);
  const node = new RosNode({
    name: "/foreign",
    rosMasterUri: getEnvVar("ROS_MASTER_URI"),
    hostname,
    pid: getPid(),
    httpServer: new HttpServerNodejs(),
    tcpSocketCreate: TcpSocketNode.Create,
    tcpServer: await TcpServerNode.Listen({ host: hostname }),
  });
  node.on("error", (error) => say("error", String(error)));
  await node.start();
  process.stdin.on("end", () => {
    node.shutdown();
    setTimeout(() => process.exit(0), 200);
  });
  process.stdin.resume();

  await node.advertise({
    topic: "/foreign/scan",
    dataType: "sensor_msgs/LaserScan",
    latching: true,
    messageDefinition: parse(getEnvVar("FULL_TEXT")),
    messageDefinitionText: getEnvVar("FULL_TEXT"),
    md5sum: getEnvVar("MD5SUM"),
  });
  await node.publish("/foreign/scan", {
    header: { seq: 0, stamp: { sec: 1234567890, nsec: 987654321 }, frame_id: "zażółć" },
    angle_min: 0,
    angle_max: 0,
    angle_increment: 0,
    time_increment: 0,
    scan_time: 0,
    range_min: 0,
    range_max: 40.5,
    ranges: [0.5, 1.5, 2.5],
    intensities: [],
  });
  await node.setParameter("/foreign/param", { list: [1, "two", 3.5], flag: true });

  const scans = node.subscribe({ topic: "/ours/scan", dataType: "sensor_msgs/LaserScan" });
  scans.on("header", (header) => say("header", { type: header.get("type"), md5sum: header.get("md5sum") }));
  scans.on("message", ({ header, ranges, range_max }) =>
    say("scan", { frame: header.frame_id, stamp: header.stamp, ranges: Array.from(ranges), range_max }),
  );
  node.subscribe({ topic: "/ours/beat", dataType: "std_msgs/Int32" }).on("message", ({ data }) => say("beat", data));
  say("param", await node.subscribeParam("/ours/param"));
  node.on("paramUpdate", ({ key, value }) => say("paramUpdate", { key, value }));
  const { publishers } = await node.getSystemState();
  say("publishers", Array.from(publishers.get("/ours/scan") || []));
  say("ready", null);
}

main().catch((error) => say("error", String(error && error.stack)));
