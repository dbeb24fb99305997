// A node of rosnodejs that uses all of minirospy, and offers the same to it. One JSON line for each thing that it saw.
// Messages are generated from the definitions of ROS_PACKAGE_PATH. Ends with its input.
"use strict";

const rosnodejs = require("rosnodejs");

const say = (what, value) => process.stdout.write(JSON.stringify({ what, value }) + "\n");
process.on("unhandledRejection", (error) => say("error", String(error && error.stack)));
process.stdin.on("end", () => process.exit(0));
process.stdin.resume();

async function main() {
  const node = await rosnodejs.initNode("/foreign", { onTheFly: true, logging: { skipRosLogging: false } });
  const { LaserScan } = rosnodejs.require("sensor_msgs").msg;
  const { SetBool } = rosnodejs.require("std_srvs").srv;

  const scan = new LaserScan();
  scan.header.frame_id = "zażółć";
  scan.header.stamp = { secs: 1234567890, nsecs: 987654321 };
  scan.range_max = 40.5;
  scan.ranges = [0.5, 1.5, 2.5];
  node.advertise("/foreign/scan", LaserScan, { latching: true, queueSize: 1 }).publish(scan);

  node.advertiseService("/foreign/flag", SetBool, (request, response) => {
    response.success = request.data;
    response.message = "from rosnodejs: zażółć";
    return true;
  });

  const server = new rosnodejs.SimpleActionServer({
    nh: node,
    type: "actionlib_tutorials/Fibonacci",
    actionServer: "/foreign/fibonacci",
    executeCallback: async (goal) => {
      const Sequence = rosnodejs.require("actionlib_tutorials").msg;
      server.publishFeedback(new Sequence.FibonacciFeedback({ sequence: [0] }));
      // Feedback and result have separate connections: the client reports that the one has arrived.
      while (!(await node.hasParam("/foreign/heard"))) {
        await new Promise((resolve) => setTimeout(resolve, 20));
      }
      server.setSucceeded(new Sequence.FibonacciResult({ sequence: Array(goal.order).fill(7) }));
    },
  });
  server.start();

  await node.setParam("/foreign/param", { list: [1, "two", 3.5], flag: true });

  node.subscribe("/ours/scan", LaserScan, (message) => {
    const { header, ranges, range_max } = message;
    say("scan", { frame: header.frame_id, stamp: header.stamp, ranges: Array.from(ranges), range_max });
  });
  // By default it keeps one message of those that come together.
  node.subscribe("/ours/beat", "std_msgs/Int32", (message) => say("beat", message.data), { throttleMs: -1 });
  say("ready", null);

  await node.waitForService("/ours/flag", 150000);
  const client = node.serviceClient("/ours/flag", SetBool);
  say("flag", await client.call(new SetBool.Request({ data: true })));
  try {
    await client.call(new SetBool.Request({ data: false }));
  } catch (error) {
    say("refused", String(error));
  }
  say("param", await node.getParam("/ours/param"));
  say("has", [await node.hasParam("/ours/param"), await node.hasParam("/ours/none")]);

  const actions = new rosnodejs.SimpleActionClient({
    nh: node,
    type: "actionlib_tutorials/Fibonacci",
    actionServer: "/ours/fibonacci",
  });
  await actions.waitForServer({ secs: 150, nsecs: 0 });
  await actions.sendGoalAndWait({ order: 3 }, { secs: 150, nsecs: 0 }, { secs: 150, nsecs: 0 });
  say("fibonacci", Array.from(actions.getResult().sequence));
  await rosnodejs.nh.deleteParam("/ours/param");
  say("done", null);
}

main().catch((error) => say("error", String(error && error.stack)));
