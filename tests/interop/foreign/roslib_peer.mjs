// A program of roslib.js: `node roslib_peer.mjs PORT` does what test_interop_rosbridge.py expects, and prints it as JSON.

import { createRequire } from "node:module";
import { pathToFileURL } from "node:url";

const modules = createRequire(process.env.NODE_PATH + "/");
globalThis.WebSocket = globalThis.WebSocket ?? modules("ws").WebSocket;
const ROSLIB = await import(pathToFileURL(`${process.env.NODE_PATH}/roslib/dist/RosLib.js`));

const ros = new ROSLIB.Ros({ url: `ws://127.0.0.1:${process.argv[2]}` });
await new Promise((resolve) => ros.on("connection", resolve));
const done = {};
for (const compression of ["none", "png", "cbor", "cbor-raw"]) {
  const options = { ros, name: "/latched_scan", messageType: "sensor_msgs/LaserScan", compression };
  const topic = new ROSLIB.Topic(options);
  const message = await new Promise((resolve) => topic.subscribe(resolve));
  done[compression] = message.ranges ? Array.from(message.ranges) : Object.keys(message);
  topic.unsubscribe();
}
done.topics = await new Promise((resolve, reject) =>
  ros.getTopics((found) => resolve(found.topics.includes("/latched_scan")), reject),
);
const parameter = new ROSLIB.Param({ ros, name: "/js" });
await new Promise((resolve) => parameter.set(2.5, resolve));
done.parameter = await new Promise((resolve) => parameter.get(resolve));
console.log(JSON.stringify(done));
process.exit(0);
