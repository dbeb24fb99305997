// A conversation by @foxglove/ws-protocol, the client of Foxglove Studio and Lichtblick; a line of JSON for each step.
// node foxglove_ws_client.js URL SUB-PROTOCOL; both packages are found by NODE_PATH.
const { App } = require("./foxglove_app.js");

const [url, subprotocol] = process.argv.slice(2);
const app = new App(url, subprotocol);
const { client } = app;
const say = (step, value) => console.log(JSON.stringify({ step, value }));
const once = (name, wanted) => app.once(name, wanted);
const bytes = (view) => Buffer.from(view.buffer, view.byteOffset, view.byteLength);

client.on("error", (error) => say("error", String(error)));
client.on("status", (status) => say("status", status.message));

(async () => {
  const info = await app.info;
  say("serverInfo", { capabilities: info.capabilities, distro: info.metadata.ROS_DISTRO });

  const channel = await app.channel("/latched");
  const subscription = client.subscribe(channel.id);
  const message = await once("message", (each) => each.subscriptionId === subscription);
  say("message", { schema: channel.schemaName, hex: bytes(message.data).toString("hex") });
  client.unsubscribe(subscription);

  const service = await app.service("/set");
  const answer = once("serviceCallResponse", (each) => each.callId === 7);
  client.sendServiceCallRequest({
    serviceId: service.id,
    callId: 7,
    encoding: "ros1",
    data: new DataView(new Uint8Array([1]).buffer),
  });
  say("service", bytes((await answer).data).toString("hex"));
  const failure = once("serviceCallFailure");
  client.sendServiceCallRequest({ serviceId: 9999, callId: 8, encoding: "ros1", data: new DataView(new ArrayBuffer(0)) });
  say("failure", (await failure).message);

  client.setParameters([{ name: "/from_node", value: [1.5, 2], type: "float64_array" }], "set");
  const values = await once("parameterValues", (each) => each.id === "set");
  say("parameters", values.parameters);
  client.subscribeParameterUpdates(["/from_node"]);
  client.getParameters(["/from_node"], "again");
  await once("parameterValues", (each) => each.id === "again");

  client.subscribeConnectionGraph();
  const graph = await once("connectionGraphUpdate");
  say("graph", graph.publishedTopics.some((each) => each.name === "/latched"));

  client.fetchAsset("package://no_such_package/a.stl", 3);
  const asset = await once("fetchAssetResponse");
  say("asset", { id: asset.requestId, status: asset.status, error: asset.error });

  const large = "x".repeat(2000000);
  const own = client.advertise({ topic: "/from_node", encoding: "ros1", schemaName: "std_msgs/String" });
  const text = Buffer.alloc(4 + large.length);
  text.writeUInt32LE(large.length);
  text.write(large, 4);
  const echo = client.subscribe((await app.channel("/from_node")).id);
  const timer = setInterval(() => client.sendMessage(own, new Uint8Array(text)), 100);
  const returned = await once("message", (each) => each.subscriptionId === echo);
  clearInterval(timer);
  say("published", bytes(returned.data).equals(text));
  client.unadvertise(own);
  client.close();
  app.socket.close();
})();
