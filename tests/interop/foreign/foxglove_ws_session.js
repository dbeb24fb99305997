// A session of @foxglove/ws-protocol: images, tf, an action's topics, changes of parameters, and the bridge's restart.
// The address is in BRIDGE_URL; the packages are found by NODE_PATH. It ends with its input.
const { createHash } = require("node:crypto");
const { App } = require("./foxglove_app.js");

const url = process.env.BRIDGE_URL;
const say = (what, value) => console.log(JSON.stringify({ what, value }));
process.on("unhandledRejection", (error) => say("error", String(error && error.stack)));
process.stdin.on("end", () => process.exit(0));
process.stdin.resume();

const connected = async () => {
  for (;;) {
    const app = new App(url, "foxglove.sdk.v1");
    if (await app.opened) {
      return app;
    }
    await new Promise((resolve) => setTimeout(resolve, 100));
  }
};

(async () => {
  let app = await connected();
  const first = await app.info;
  const image = await app.read("/image");
  const digest = createHash("sha1").update(image.data).digest("hex");
  say("image", [image.width, image.encoding, digest]);
  const frames = (message) => message.transforms.map((each) => each.child_frame_id);
  say("tf_static", frames(await app.read("/tf_static")));
  say("tf", frames(await app.read("/tf")));

  const send = await app.publisher("/fibonacci/goal", "actionlib_tutorials/FibonacciActionGoal");
  const stamp = { sec: 0, nsec: 0 };
  const isOurs = (message) => message.status.goal_id.id === "from-node";
  const status = app.read("/fibonacci/status", (message) => message.status_list.some((each) => each.goal_id.id === "from-node"));
  const feedback = app.read("/fibonacci/feedback", isOurs);
  const result = app.read("/fibonacci/result", isOurs);
  // Until the action server is connected, goals reach nobody; it takes one of an id once.
  const goal = { header: { seq: 0, stamp, frame_id: "" }, goal_id: { stamp, id: "from-node" }, goal: { order: 4 } };
  const timer = setInterval(() => send(goal), 200);
  await status;
  clearInterval(timer);
  say("action", [Array.from((await feedback).feedback.sequence), Array.from((await result).result.sequence)]);

  app.client.on("parameterValues", (event) => event.id === undefined && say("changed", event.parameters));
  app.client.subscribeParameterUpdates(["/speed"]);
  app.client.getParameters([], "sync");
  await app.once("parameterValues", (event) => event.id === "sync");
  say("watching", true);

  await app.closed;
  app = await connected();
  const second = await app.info;
  const again = await app.read("/image");
  say("again", [first.sessionId !== second.sessionId, again.width]);
})();
