// The part that programs of @foxglove/ws-protocol share: a connection, the tables of what is offered.
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader, MessageWriter } = require("@foxglove/rosmsg-serialization");
const WebSocket = require("ws");

class App {
  constructor(url, subprotocol) {
    this.socket = new WebSocket(url, [subprotocol]);
    this.client = new FoxgloveClient({ ws: this.socket });
    this.channels = new Map();
    this.services = new Map();
    this.client.on("advertise", (offered) => offered.forEach((each) => this.channels.set(each.topic, each)));
    this.client.on("advertiseServices", (offered) => offered.forEach((each) => this.services.set(each.name, each)));
    this.info = this.once("serverInfo");
    this.info.catch(() => {});
    this.closed = new Promise((resolve) => this.client.on("close", resolve));
    this.opened = new Promise((resolve) => {
      this.client.on("open", () => resolve(true));
      this.client.on("error", () => resolve(false));
      this.client.on("close", () => resolve(false));
    });
  }

  // The next event of this name that is wanted.
  once(name, wanted = () => true) {
    return new Promise((resolve) => {
      const listener = (event) => {
        if (wanted(event)) {
          this.client.off(name, listener);
          resolve(event);
        }
      };
      this.client.on(name, listener);
    });
  }

  async channel(topic) {
    while (!this.channels.has(topic)) {
      await this.once("advertise");
    }
    return this.channels.get(topic);
  }

  async service(name) {
    while (!this.services.has(name)) {
      await this.once("advertiseServices");
    }
    return this.services.get(name);
  }

  // The first message of a topic that is wanted, deserialized by the channel's schema.
  async read(topic, wanted = () => true) {
    const channel = await this.channel(topic);
    const reader = new MessageReader(parse(channel.schema));
    const subscription = this.client.subscribe(channel.id);
    let found;
    await this.once("message", (event) => {
      if (event.subscriptionId !== subscription) {
        return false;
      }
      found = reader.readMessage(event.data);
      return wanted(found);
    });
    this.client.unsubscribe(subscription);
    return found;
  }

  // A function that publishes a message; the schema is that of the channel which the bridge then offers.
  async publisher(topic, schemaName) {
    const own = this.client.advertise({ topic, encoding: "ros1", schemaName });
    const writer = new MessageWriter(parse((await this.channel(topic)).schema));
    return (message) => this.client.sendMessage(own, writer.writeMessage(message));
  }
}

module.exports = { App };
