// The page's side of the worker: what the bridge offers, subscriptions, calls. Views get what they need from here.

import { parseDefinition } from "./ros1.js";
import { t, errorText } from "./texts.js";
import { Tools } from "./tools.js";

export class Link extends EventTarget {
  constructor(token) {
    super();
    this.state = "connecting";
    this.node = "";
    this.capabilities = new Set();
    this.channels = new Map(); // topic -> {topic, type, schema}
    this.services = new Map(); // name -> {name, type, request}
    this.graph = { published: new Map(), subscribed: new Map(), services: new Map() };
    this.parameters = new Map();
    this.parameterTypes = new Map(); // "float64" and "float64_array" if the numbers are doubles
    this.time = null; // seconds of /clock, where time is simulated
    this.token = token;
    this.entries = new Map();
    this.answers = new Map();
    this.nextKey = 1;
    this.definitions = new Map();
    this.tools = new Tools(this);
    this.worker = new Worker(new URL("./worker.js", import.meta.url), { type: "module" });
    this.worker.onmessage = ({ data }) => this.handlers[data.kind](data);
    this.worker.onerror = (event) => this.emit("notice", { level: 2, message: `the worker failed: ${event.message}` });
    this.worker.postMessage({ command: "connect", url: this.address(), protocols: this.protocols("foxglove.sdk.v1") });
  }

  /** Return the address of the WebSocket: the page's own server, also below a path of a proxy. */
  address(query = "") {
    const folder = location.pathname.slice(0, location.pathname.lastIndexOf("/") + 1);
    return `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}${folder}${query}`;
  }

  /** Return the status and the reason if the server refuses this page, else null. A WebSocket does not tell. */
  async refusal() {
    const headers = this.token ? { authorization: `Bearer ${this.token}` } : {};
    const answer = await fetch("status", { headers }).catch(() => null);
    return answer && !answer.ok ? { status: answer.status, text: (await answer.text()).trim() } : null;
  }

  protocols(name) {
    return this.token ? [name, `minirospy.token.${this.token}`] : [name];
  }

  handlers = {
    state: ({ state, capabilities, node }) => {
      this.state = state;
      if (state === "open") {
        this.capabilities = new Set(capabilities);
        this.node = node;
      } else {
        this.channels = new Map();
        this.services = new Map();
        this.graph = { published: new Map(), subscribed: new Map(), services: new Map() };
        this.emit("channels");
        this.emit("services");
        this.emit("graph");
      }
      this.emit("state");
    },
    channels: ({ channels }) => {
      this.channels = new Map(channels.sort((a, b) => (a.topic < b.topic ? -1 : 1)).map((each) => [each.topic, each]));
      this.emit("channels");
    },
    services: ({ services }) => {
      this.services = new Map(services.sort((a, b) => (a.name < b.name ? -1 : 1)).map((each) => [each.name, each]));
      this.emit("services");
    },
    graph: (update) => {
      const { published, subscribed, services } = this.graph;
      for (const { name, publisherIds } of update.publishedTopics) published.set(name, publisherIds);
      for (const { name, subscriberIds } of update.subscribedTopics) subscribed.set(name, subscriberIds);
      for (const { name, providerIds } of update.advertisedServices) services.set(name, providerIds);
      for (const name of update.removedTopics) for (const table of [published, subscribed]) table.delete(name);
      for (const name of update.removedServices) services.delete(name);
      this.emit("graph");
    },
    parameters: ({ parameters, isAll }) => {
      if (isAll) this.parameters = new Map();
      for (const { name, value, type } of parameters) {
        this.parameterTypes.set(name, type);
        if (value === undefined) {
          for (const each of [...this.parameters.keys()]) {
            if (each === name || each.startsWith(`${name}/`)) this.parameters.delete(each);
          }
        } else this.parameters.set(name, value);
      }
      this.emit("parameters");
    },
    time: ({ seconds }) => {
      this.time = seconds;
      this.emit("time");
    },
    status: (status) => this.emit("notice", status),
    removeStatus: ({ ids }) => this.emit("withdrawn", ids),
    answer: ({ id, response, error, errorValues }) => {
      const answer = this.answers.get(id);
      this.answers.delete(id);
      if (error !== undefined) answer?.reject(new Error(t(error, errorValues)));
      else answer?.resolve(response);
    },
    batch: ({ items }) => {
      // Handled before the next one is made, so a slow page makes batches larger, not more.
      try {
        for (const item of items) {
          if (item.error !== undefined) item.error = t(item.error, item.errorValues);
          try {
            this.entries.get(item.key)?.(item);
          } catch (error) {
            reportError(error); // of one view: the others get theirs
          }
        }
      } finally {
        this.worker.postMessage({ command: "handled" });
      }
    },
  };

  emit(name, detail) {
    this.dispatchEvent(new CustomEvent(name, { detail }));
  }

  /** Call a function on these events, and now; return what ends it. */
  watch(names, react) {
    const listener = () => react();
    for (const name of names) this.addEventListener(name, listener);
    react();
    return () => {
      for (const name of names) this.removeEventListener(name, listener);
    };
  }

  /**
   * Subscribe: entry is {topic, mode: "latest" or "all", isCounted, isOwn} or {path, mode: "series"}; return what ends
   * it.
   */
  subscribe(entry, received) {
    const key = this.nextKey++;
    this.entries.set(key, received);
    this.worker.postMessage({ command: "subscribe", entry: { ...entry, key } });
    return () => {
      this.entries.delete(key);
      this.worker.postMessage({ command: "unsubscribe", key });
    };
  }

  request(fields) {
    const id = this.nextKey++;
    return new Promise((resolve, reject) => {
      this.answers.set(id, { resolve, reject });
      this.worker.postMessage({ ...fields, id });
    });
  }

  /** Call a service; the promise has its response as an object. */
  call(service, request) {
    return this.request({ command: "call", service, request });
  }

  publish(topic, type, schema, message) {
    return this.request({ command: "publish", topic, type, schema, message });
  }

  /** Advertise a topic before its first message, so that subscribers are connected then. */
  advertise(topic, type, schema) {
    this.worker.postMessage({ command: "advertise", topic, type, schema });
  }

  unpublish(topic) {
    this.worker.postMessage({ command: "unpublish", topic });
  }

  /** Fetch a file by its package:// URI; the promise has its bytes. */
  asset(uri) {
    return this.request({ command: "asset", uri });
  }

  /** Set a parameter; undefined deletes it. */
  setParameter(name, value) {
    this.worker.postMessage({ command: "setParameter", name, value });
  }

  /** Return the description of a type, null if its text cannot be parsed. */
  definition(type, text) {
    const key = `${type}\n${text}`;
    if (!this.definitions.has(key)) {
      let found = null;
      try {
        found = parseDefinition(type, text);
      } catch (error) {
        this.emit("notice", { level: 1, message: `${type}: ${errorText(error)}` });
      }
      this.definitions.set(key, found);
    }
    return this.definitions.get(key);
  }

  get mayWrite() {
    return this.capabilities.has("clientPublish");
  }
}
