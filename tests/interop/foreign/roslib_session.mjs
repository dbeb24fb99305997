// A session of roslib.js: services of both sides, actions of both sides, tf, parameters, binary, and the bridge's restart.
// The address is in BRIDGE_URL; the packages are found by NODE_PATH. It ends with its input.

import { createHash } from "node:crypto";
import { createRequire } from "node:module";
import { pathToFileURL } from "node:url";

const modules = createRequire(process.env.NODE_PATH + "/");
globalThis.WebSocket = globalThis.WebSocket ?? modules("ws").WebSocket;
const ROSLIB = await import(pathToFileURL(`${process.env.NODE_PATH}/roslib/dist/RosLib.js`));

const say = (what, value) => console.log(JSON.stringify({ what, value }));
process.on("unhandledRejection", (error) => say("error", String(error && error.stack)));
process.stdin.on("end", () => process.exit(0));
process.stdin.resume();

const url = process.env.BRIDGE_URL;
const ros = new ROSLIB.Ros();
const connect = async () => {
  const connected = new Promise((resolve) => ros.once("connection", () => resolve(true)));
  const failed = new Promise((resolve) => ros.once("close", () => resolve(false)));
  ros.connect(url).catch(() => {});
  if (!(await Promise.race([connected, failed]))) {
    await new Promise((resolve) => setTimeout(resolve, 100));
    await connect();
  }
};
ros.on("error", () => {});
await connect();
const digest = (data) => createHash("sha1").update(data).digest("hex");
const next = (topic) => new Promise((resolve) => topic.subscribe(resolve));
const topic = (name, messageType, options = {}) => new ROSLIB.Topic({ ros, name, messageType, ...options });

// Binary, in both encodings and directions.
const plain = await next(topic("/image", "sensor_msgs/Image"));
say("image", [plain.width, digest(Buffer.from(plain.data, "base64"))]);
const typed = topic("/image", "sensor_msgs/Image", { compression: "cbor" });
say("cbor", digest((await next(typed)).data));
typed.unsubscribe();
topic("/image_copy", "sensor_msgs/Image").publish(plain);

// Services of both sides.
const called = (name, request) =>
  new Promise((resolve) => {
    const service = new ROSLIB.Service({ ros, name, serviceType: "std_srvs/SetBool" });
    service.callService(request, resolve, (error) => resolve(String(error)));
  });
say("service", await called("/set", { data: true }));
say("refusal", await called("/refuse", { data: true }));
const offer = (name) => new ROSLIB.Service({ ros, name, serviceType: "std_srvs/SetBool" });
const ours = offer("/ours");
await ours.advertise((request, response) => {
  response.success = request.data;
  response.message = "from roslib.js";
  return true;
});
await offer("/ours_later").advertiseAsync(async (request) => {
  if (!request.data) {
    throw new Error("not today");
  }
  return { success: true, message: "later" };
});

// Parameters.
const parameter = new ROSLIB.Param({ ros, name: "/js" });
await new Promise((resolve) => parameter.set({ speed: 2.5, list: [1, "two"] }, resolve));
say("parameter", await new Promise((resolve) => parameter.get(resolve)));
await new Promise((resolve) => parameter.delete(resolve));

// Actions of both sides.
const actionName = "actionlib_tutorials/FibonacciAction";
const actionClient = new ROSLIB.ActionClient({ ros, serverName: "/fibonacci", actionName });
const goal = new ROSLIB.Goal({ actionClient, goalMessage: { order: 4 } });
const feedback = new Promise((resolve) => goal.once("feedback", resolve));
const result = new Promise((resolve) => goal.once("result", resolve));
goal.send();
say("action", [(await feedback).sequence, (await result).sequence, goal.status.status]);
const server = new ROSLIB.SimpleActionServer({ ros, serverName: "/js_fibonacci", actionName });
server.on("goal", (request) => {
  server.sendFeedback({ sequence: [7] });
  server.setSucceeded({ sequence: Array.from({ length: request.order }, (_, number) => number) });
});

// tf, by tf2_web_republisher.
const tf = new ROSLIB.TFClient({ ros, fixedFrame: "world", angularThres: 0, transThres: 0, rate: 10 });
const transform = await new Promise((resolve) => tf.subscribe("camera", resolve));
say("tf", [transform.translation.x, transform.rotation.w]);
tf.dispose();
say("ready", true);

// The bridge is replaced by another one.
const latched = topic("/latched", "std_msgs/String");
const values = [];
let came = () => {};
latched.subscribe((message) => {
  values.push(message.data);
  came();
});
const valueOf = async (count) => {
  while (values.length < count) {
    await new Promise((resolve) => (came = resolve));
  }
  return values[count - 1];
};
const closed = new Promise((resolve) => ros.once("close", resolve));
say("latched", await valueOf(1));
await closed;
await connect();
say("again", [await valueOf(2), await called("/set", { data: false })]);
// roslib.js offers topics again, services not.
await ours.unadvertise();
await ours.advertise((request, response) => {
  response.success = request.data;
  response.message = "again";
  return true;
});
say("offered", true);
