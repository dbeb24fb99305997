// The worker: the WebSocket of the bridge, and the decoding of messages. The page sends it commands and gets batches.
// Nothing waits here without a bound: if the page is slow, a topic's older messages give way to newer ones.
// Protocol: https://github.com/foxglove/ws-protocol (docs/spec.md); its schemas are the texts of the definitions.

import { TextError, decode, encode, parseDefinition } from "./ros1.js";
import { PathError, canLead, numericPaths, parseSteps, select, stampOf, topicOf } from "./paths.js";

const FLUSH_MS = 33;
const FIRST_DELAY_MS = 300;
const MAX_DELAY_MS = 4000;
const MAX_LINES = 30_000; // of one subscriber to all messages, between two batches
const MAX_POINTS = 1_000_000; // of one series, between two batches

let url = "";
let protocols = [];
let socket = null;
let delay = FIRST_DELAY_MS;
let isConnectedOnce = false;
let capabilities = new Set();

const channels = new Map(); // topic -> channel
const services = new Map(); // name -> service
const definitions = new Map(); // type and text -> definition or Error
const wanted = new Map(); // key -> {key, topic or path, mode, ...}
const topics = new Map(); // topic -> {subscription, channelId, definition, users: Set, last}
const bySubscription = new Map();
const calls = new Map();
const published = new Map(); // topic -> {id, type, definition, waiting}
let nextId = 1;

let isScheduled = false;
let isAwaited = false; // a batch that the page has not handled yet

const post = (message, transfer = []) => /** @type {any} */ (self).postMessage(message, transfer);
/** Return the fields by which the page is notified of an error, in its language. */
const faultOf = ({ message, text = message, values = null }) => ({ error: text, errorValues: values });
const failing = (id) => (error) =>
  post({ kind: "answer", id, ...faultOf(typeof error === "string" ? { message: error } : error) });
const send = (fields) => {
  if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(fields));
};

// --- the connection

function connect() {
  post({ kind: "state", state: isConnectedOnce ? "lost" : "connecting" });
  socket = new WebSocket(url, protocols);
  socket.binaryType = "arraybuffer";
  socket.onmessage = ({ data }) => (typeof data === "string" ? receivedText(JSON.parse(data)) : receivedBinary(data));
  socket.onclose = () => {
    disconnected();
    post({ kind: "state", state: isConnectedOnce ? "lost" : "refused" });
    setTimeout(connect, delay);
    delay = Math.min(delay * 1.6, MAX_DELAY_MS);
  };
}

function disconnected() {
  for (const { reject } of calls.values()) reject("the connection is lost");
  calls.clear();
  published.clear();
  channels.clear();
  services.clear();
  bySubscription.clear();
  for (const topic of topics.values()) topic.subscription = null;
}

const TEXT_HANDLERS = {
  serverInfo(fields) {
    isConnectedOnce = true;
    delay = FIRST_DELAY_MS;
    capabilities = new Set(fields.capabilities);
    post({ kind: "state", state: "open", capabilities: fields.capabilities, node: fields.metadata?.node ?? "" });
    if (capabilities.has("connectionGraph")) send({ op: "subscribeConnectionGraph" });
    if (capabilities.has("parametersSubscribe")) {
      send({ op: "getParameters", parameterNames: [], id: "all" });
      send({ op: "subscribeParameterUpdates", parameterNames: [] });
    }
  },
  advertise(fields) {
    for (const channel of fields.channels) {
      channels.set(channel.topic, channel);
      // A channel that is offered again has another definition.
      for (const topic of topics.values()) if (topic.name === channel.topic) subscribeTopic(topic);
    }
    for (const each of wanted.values()) if (each.topic === null) resolvePath(each);
    postChannels();
  },
  unadvertise(fields) {
    const gone = new Set(fields.channelIds);
    for (const [topic, channel] of channels) {
      if (!gone.has(channel.id)) continue;
      channels.delete(topic);
      for (const used of topics.values()) {
        if (used.name !== topic || used.channelId !== channel.id) continue;
        bySubscription.delete(used.subscription);
        used.subscription = null;
      }
    }
    postChannels();
  },
  advertiseServices(fields) {
    for (const service of fields.services) services.set(service.name, service);
    postServices();
  },
  unadvertiseServices(fields) {
    const gone = new Set(fields.serviceIds);
    for (const [name, service] of services) if (gone.has(service.id)) services.delete(name);
    postServices();
  },
  connectionGraphUpdate(fields) {
    post({ kind: "graph", ...fields });
  },
  parameterValues(fields) {
    post({ kind: "parameters", parameters: fields.parameters, isAll: fields.id === "all" });
  },
  status(fields) {
    post({ kind: "status", level: fields.level, message: fields.message, id: fields.id ?? null });
  },
  removeStatus(fields) {
    post({ kind: "removeStatus", ids: fields.statusIds });
  },
  serviceCallFailure(fields) {
    finishCall(fields.callId, (call) => call.reject(fields.message));
  },
};

function receivedText(fields) {
  TEXT_HANDLERS[fields.op]?.(fields);
}

function receivedBinary(buffer) {
  const view = new DataView(buffer);
  const opcode = view.getUint8(0);
  if (opcode === 1) {
    const topic = bySubscription.get(view.getUint32(1, true));
    if (topic) received(topic, Number(view.getBigUint64(5, true)) / 1e9, new Uint8Array(buffer, 13));
  } else if (opcode === 2) {
    post({ kind: "time", seconds: Number(view.getBigUint64(1, true)) / 1e9 });
  } else if (opcode === 3) {
    const length = view.getUint32(9, true);
    finishCall(view.getUint32(5, true), (call) => call.resolve(new Uint8Array(buffer, 13 + length)));
  } else if (opcode === 4) {
    const length = view.getUint32(6, true);
    const isFailed = view.getUint8(5) !== 0;
    finishCall(view.getUint32(1, true), (call) => {
      if (isFailed) call.reject(new TextDecoder().decode(new Uint8Array(buffer, 10, length)));
      else call.resolve(new Uint8Array(buffer, 10 + length));
    });
  }
}

function finishCall(id, finish) {
  const call = calls.get(id);
  calls.delete(id);
  if (call) finish(call);
}

function postChannels() {
  post({
    kind: "channels",
    channels: [...channels.values()].map(({ topic, schemaName, schema }) => ({ topic, type: schemaName, schema })),
  });
}

function postServices() {
  post({
    kind: "services",
    services: [...services.values()].map((each) => ({
      name: each.name,
      type: each.type,
      request: each.request.schema,
    })),
  });
}

function definitionOf(type, text) {
  const key = `${type}\n${text}`;
  if (!definitions.has(key)) {
    let found;
    try {
      found = parseDefinition(type, text);
    } catch (error) {
      found = error;
    }
    definitions.set(key, found);
  }
  const found = definitions.get(key);
  if (found instanceof Error) throw found;
  return found;
}

// --- topics

function subscribe(entry) {
  entry.count = entry.bytes = 0;
  entry.lines = [];
  entry.series = new Map();
  entry.newest = null;
  entry.error = null;
  wanted.set(entry.key, entry);
  if (entry.path !== undefined) {
    entry.topic = null;
    resolvePath(entry);
  } else {
    use(entry);
  }
}

function resolvePath(entry) {
  const topic = topicOf(entry.path, channels.keys());
  try {
    // Wrong syntax is refused before its topic is there.
    entry.steps = parseSteps(entry.path.slice((topic ?? /^(\/\w+)*/.exec(entry.path)[0]).length));
  } catch (error) {
    entry.error = error;
    schedule();
    return;
  }
  if (topic === null) return;
  entry.topic = topic;
  use(entry);
  const { definition } = topics.get(entry.place);
  if (!definition || canLead(definition, entry.steps)) return;
  entry.error = noNumber(topic, definition);
  schedule();
}

function noNumber(topic, definition) {
  const paths = numericPaths(definition, 3)
    .map((path) => topic + path)
    .join(", ");
  return new PathError(paths ? "no number there; there is {paths}" : "no number there; there is none in this topic", {
    paths,
  });
}

function use(entry) {
  // One of its own gets all that is latched, however many publishers there are.
  entry.place = entry.isOwn ? `${entry.topic} ${entry.key}` : entry.topic;
  let topic = topics.get(entry.place);
  if (!topic) {
    topic = {
      name: entry.topic,
      place: entry.place,
      subscription: null,
      channelId: null,
      users: new Set(),
      last: null,
      definition: null,
    };
    topics.set(entry.place, topic);
  }
  topic.users.add(entry);
  if (topic.subscription === null) subscribeTopic(topic);
  // A latched message comes once for a subscription, however many share it.
  else if (topic.last && entry.mode !== "all") give(topic, entry, topic.last.seconds, topic.last.bytes);
}

function subscribeTopic(topic) {
  const channel = channels.get(topic.name);
  if (!channel || (topic.subscription !== null && topic.channelId === channel.id)) return;
  if (topic.subscription !== null) endSubscription(topic);
  topic.subscription = nextId++;
  topic.channelId = channel.id;
  topic.definition = null;
  topic.last = null;
  try {
    topic.definition = definitionOf(channel.schemaName, channel.schema);
  } catch (error) {
    topic.failure = error;
  }
  bySubscription.set(topic.subscription, topic);
  send({ op: "subscribe", subscriptions: [{ id: topic.subscription, channelId: channel.id }] });
}

function endSubscription(topic) {
  send({ op: "unsubscribe", subscriptionIds: [topic.subscription] });
  bySubscription.delete(topic.subscription);
  topic.subscription = null;
}

function unsubscribe(key) {
  const entry = wanted.get(key);
  wanted.delete(key);
  const topic = entry && topics.get(entry.place);
  if (!topic) return;
  topic.users.delete(entry);
  if (!topic.users.size) {
    if (topic.subscription !== null) endSubscription(topic);
    topics.delete(topic.place);
  }
}

function received(topic, seconds, bytes) {
  topic.last = { seconds, bytes };
  let message;
  for (const entry of topic.users) message = give(topic, entry, seconds, bytes, message);
}

/** Take over a message for a subscriber; return it decoded, if it was. */
function give(topic, entry, seconds, bytes, decoded) {
  schedule();
  if (entry.mode === "latest") {
    // Decoded when it is sent to the page, if it still is the newest then.
    entry.count += 1;
    entry.bytes += bytes.byteLength;
    entry.newest = { topic, seconds, bytes };
    return decoded;
  }
  let message = decoded;
  try {
    if (!topic.definition) throw topic.failure;
    message ??= decode(topic.definition, bytes);
  } catch (error) {
    entry.error = error;
    return undefined;
  }
  if (entry.mode === "all") {
    entry.lines.push({ seconds, message });
    if (entry.lines.length > MAX_LINES) entry.lines.splice(0, MAX_LINES / 10);
    return message;
  }
  let isFound = false;
  const stamp = stampOf(message);
  select(message, entry.steps, (label, number) => {
    isFound = true;
    addPoint(entry, label, seconds, stamp, number);
  });
  entry.isFound ||= isFound;
  if (!entry.isFound) entry.error = noNumber(topic.name, topic.definition);
  return message;
}

function addPoint(entry, label, seconds, stamp, number) {
  let series = entry.series.get(label);
  if (!series) {
    series = {
      times: new Float64Array(256),
      stamps: new Float64Array(256),
      values: new Float64Array(256),
      count: 0,
      isStamped: false,
    };
    entry.series.set(label, series);
  }
  if (series.count === series.times.length) {
    if (series.count >= MAX_POINTS) return;
    for (const name of ["times", "stamps", "values"]) {
      const longer = new Float64Array(series.count * 2);
      longer.set(series[name]);
      series[name] = longer;
    }
  }
  series.times[series.count] = seconds;
  series.stamps[series.count] = stamp || seconds;
  series.isStamped ||= stamp !== 0;
  series.values[series.count++] = number;
}

// --- batches

function schedule() {
  if (isScheduled || isAwaited) return;
  isScheduled = true;
  setTimeout(flush, FLUSH_MS);
}

function flush() {
  isScheduled = false;
  const items = [];
  const transfer = [];
  for (const entry of wanted.values()) {
    const item = itemOf(entry, transfer);
    if (item) items.push(item);
  }
  if (items.length) {
    isAwaited = true;
    post({ kind: "batch", items }, transfer);
  }
}

function itemOf(entry, transfer) {
  const item = { key: entry.key };
  if (entry.mode === "latest" && entry.newest) {
    const { topic, seconds, bytes } = entry.newest;
    Object.assign(item, { seconds, count: entry.count, bytes: entry.bytes });
    entry.newest = null;
    entry.count = entry.bytes = 0;
    if (!entry.isCounted) {
      try {
        if (!topic.definition) throw topic.failure;
        item.message = decode(topic.definition, bytes);
      } catch (error) {
        Object.assign(item, faultOf(error));
      }
    }
    return item;
  }
  if (entry.mode === "all" && entry.lines.length) {
    item.lines = entry.lines;
    entry.lines = [];
    return item;
  }
  if (entry.mode === "series" && entry.series.size) {
    item.series = [];
    for (const [label, { times, stamps, values, count, isStamped }] of entry.series) {
      const part = {
        label: entry.topic + label,
        times: times.slice(0, count),
        values: values.slice(0, count),
        stamps: isStamped ? stamps.slice(0, count) : null,
      };
      transfer.push(part.times.buffer, part.values.buffer);
      item.series.push(part);
    }
    entry.series.clear();
    return item;
  }
  if (entry.error) {
    Object.assign(item, faultOf(entry.error));
    entry.error = null;
    return item;
  }
  return null;
}

// --- services, publishing, parameters

function call({ id, service: name, request }) {
  const fail = failing(id);
  const service = services.get(name);
  if (!service) return fail(new TextError("there is no service {name}, or it may not be called", { name }));
  let body;
  try {
    body = encode(definitionOf(`${service.type}Request`, service.request.schema), request);
  } catch (error) {
    return fail(error);
  }
  const callId = nextId++;
  calls.set(callId, {
    reject: fail,
    resolve(bytes) {
      try {
        post({
          kind: "answer",
          id,
          response: decode(definitionOf(`${service.type}Response`, service.response.schema), bytes),
        });
      } catch (error) {
        fail(error);
      }
    },
  });
  const frame = new Uint8Array(17 + body.length);
  const view = new DataView(frame.buffer);
  view.setUint8(0, 2);
  view.setUint32(1, service.id, true);
  view.setUint32(5, callId, true);
  view.setUint32(9, 4, true);
  frame.set([114, 111, 115, 49], 13); // "ros1"
  frame.set(body, 17);
  socket.send(frame);
}

/** Fetch a file of a package. */
function asset({ id, uri }) {
  const fail = failing(id);
  if (socket?.readyState !== WebSocket.OPEN) return fail("the connection is lost");
  const requestId = nextId++;
  calls.set(requestId, {
    reject: fail,
    resolve: (bytes) => post({ kind: "answer", id, response: bytes }, [bytes.buffer]),
  });
  return send({ op: "fetchAsset", uri, requestId });
}

/** Return the channel of a topic that is published, which is advertised if it was not. */
function publication({ topic, type, schema }) {
  let channel = published.get(topic);
  if (channel && channel.type !== type) {
    send({ op: "unadvertise", channelIds: [channel.id] });
    channel = null;
  }
  if (!channel) {
    channel = { id: nextId++, type };
    published.set(topic, channel);
    send({
      op: "advertise",
      channels: [{ id: channel.id, topic, encoding: "ros1", schemaName: type, schema, schemaEncoding: "ros1msg" }],
    });
  }
  return channel;
}

function publish({ id, topic, type, schema, message }) {
  const fail = failing(id);
  if (socket?.readyState !== WebSocket.OPEN) return fail("the connection is lost");
  if (!capabilities.has("clientPublish")) return fail("publishing is not allowed: this token is read-only");
  let body;
  try {
    body = encode(definitionOf(type, schema), message);
  } catch (error) {
    return fail(error);
  }
  const channel = publication({ topic, type, schema });
  const frame = new Uint8Array(5 + body.length);
  const view = new DataView(frame.buffer);
  view.setUint8(0, 1);
  view.setUint32(1, channel.id, true);
  frame.set(body, 5);
  socket.send(frame);
  return post({ kind: "answer", id, response: {} });
}

const COMMANDS = {
  connect(command) {
    ({ url, protocols } = command);
    connect();
  },
  handled() {
    isAwaited = false;
    schedule();
  },
  subscribe: (command) => subscribe(command.entry),
  unsubscribe: (command) => unsubscribe(command.key),
  call,
  asset,
  publish,
  advertise: (command) => {
    if (socket?.readyState === WebSocket.OPEN && capabilities.has("clientPublish")) publication(command);
  },
  unpublish({ topic }) {
    const channel = published.get(topic);
    if (channel) send({ op: "unadvertise", channelIds: [channel.id] });
    published.delete(topic);
  },
  setParameter: ({ name, value }) =>
    send({ op: "setParameters", parameters: [value === undefined ? { name } : { name, value }], id: `set ${name}` }),
};

self.onmessage = ({ data }) => COMMANDS[data.command](data);
