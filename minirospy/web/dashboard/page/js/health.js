// The state of nodes and topics, from the reports of the graph: the nodes' own counters, without a subscription. Pure.

const SILENT_REPORTS = 3; // without a message: some six seconds
const MIN_HZ = 0.5; // above this rate, a topic that falls silent is missed
const SYSTEM = new Set(["/rosout", "/rosout_agg"]);
const TOOLS = /^\/(minirospy_dashboard|minirospy_doctor|rqt_|rviz|rostopic_|rosnode_|record_)/;
// These are published all the time by what has them.
const STREAMS = new Set([
  "diagnostic_msgs/DiagnosticArray",
  "nav_msgs/Odometry",
  "rosgraph_msgs/Clock",
  "sensor_msgs/CameraInfo",
  "sensor_msgs/Image",
  "sensor_msgs/Imu",
  "sensor_msgs/JointState",
  "sensor_msgs/LaserScan",
  "sensor_msgs/PointCloud2",
  "sensor_msgs/Range",
]);
const RANKS = { mismatch: 0, unpublished: 1, silent: 2, flows: 3, quiet: 4 };

/** Return whether a node is a tool, such as this page: it comes and goes, and is no part of the robot. */
export const isTool = (name) => TOOLS.test(name);

/** Keeps for each topic how long it has been silent, from one report to the next. */
export class TopicHealth {
  constructor() {
    this.known = new Map(); // topic -> {hz: of the last reports, silent: reports without a message, hadRate}
  }

  /**
   * Return the topics of a report: {topic, type, publishers, subscribers, hz, bytes, state}.
   * hz is null if no node counts its messages. state is "mismatch" (nodes use different types), "unpublished", "silent"
   * (expected, but no message comes), "flows" or "quiet".
   */
  received({ nodes, traffic, mismatches }) {
    const topics = new Map();
    const topicOf = (topic, type) => {
      let found = topics.get(topic);
      if (!found) {
        found = { topic, type, publishers: [], subscribers: [], hz: null, bytes: 0, state: "quiet" };
        topics.set(topic, found);
      }
      if (type && type !== "*") found.type = type;
      return found;
    };
    for (const { name, publishes, subscribes } of nodes) {
      for (const [topic, type] of publishes) topicOf(topic, type).publishers.push(name);
      for (const [topic, type] of subscribes) topicOf(topic, type).subscribers.push(name);
    }
    for (const [topic, { hz, bytes }] of ratesOf(traffic)) {
      const found = topics.get(topic);
      if (found) Object.assign(found, { hz, bytes });
    }
    for (const topic of this.known.keys()) if (!topics.has(topic)) this.known.delete(topic);
    for (const found of topics.values()) {
      const before = this.known.get(found.topic) ?? { silent: 0, hadRate: false };
      const silent = found.hz === null ? 0 : found.hz > 0 ? 0 : before.silent + 1;
      const hadRate = before.hadRate || found.hz >= MIN_HZ;
      this.known.set(found.topic, { silent, hadRate });
      const isExpected = hadRate || STREAMS.has(found.type);
      const isMissed = !found.publishers.length && found.subscribers.some(isRobots);
      if (Object.hasOwn(mismatches, found.topic)) found.state = "mismatch";
      else if (isMissed && !isOfAction(found, topics)) found.state = "unpublished";
      else if (isExpected && silent >= SILENT_REPORTS) found.state = "silent";
      else if (found.hz > 0) found.state = "flows";
    }
    return [...topics.values()]
      .filter(({ topic, publishers, subscribers }) => {
        return !SYSTEM.has(topic) && [...publishers, ...subscribers].some(isRobots);
      })
      .sort(byState);
  }
}

const isRobots = (node) => !isTool(node);

function byState(one, other) {
  return (
    RANKS[one.state] - RANKS[other.state] || (other.hz ?? -1) - (one.hz ?? -1) || (one.topic < other.topic ? -1 : 1)
  );
}

/** Return topic -> {hz, bytes}: each publisher's messages count once, to whichever subscriber most were sent. */
function ratesOf(traffic) {
  const senders = new Map();
  for (const [sender, topic, , hz, bytes] of traffic) {
    const key = JSON.stringify([topic, sender]);
    const known = senders.get(key);
    if (!known || known.hz < hz) senders.set(key, { topic, hz, bytes });
  }
  const found = new Map();
  for (const { topic, hz, bytes } of senders.values()) {
    const sum = found.get(topic) ?? { hz: 0, bytes: 0 };
    found.set(topic, { hz: sum.hz + hz, bytes: sum.bytes + bytes });
  }
  return found;
}

/** Return whether a topic is the goal or cancel of an action, which often has no publisher. */
function isOfAction({ topic }, topics) {
  const [, name, end] = /^(.*)\/([^/]*)$/.exec(topic) ?? [];
  return (end === "goal" || end === "cancel") && Boolean(topics.get(`${name}/status`)?.publishers.length);
}

/** Return the nodes of a report for people: first those that do not answer, then by the use of the processor. */
export function nodesOf({ nodes }) {
  return nodes
    .filter(({ name }) => isRobots(name))
    .sort(
      (one, other) =>
        Number(Boolean(other.trouble)) - Number(Boolean(one.trouble)) ||
        (other.cpu ?? -1) - (one.cpu ?? -1) ||
        (one.name < other.name ? -1 : 1),
    );
}

/** Return a text that changes if the doctor should look again: what is wrong with the graph. */
export function signatureOf(nodes, topics) {
  return JSON.stringify([
    nodes.map(({ name }) => name).sort(),
    nodes
      .filter(({ trouble }) => trouble)
      .map(({ name }) => name)
      .sort(),
    topics
      .filter(({ state }) => state === "mismatch" || state === "unpublished")
      .map(({ topic }) => topic)
      .sort(),
  ]);
}

/**
 * Return {level: "good", "warning" or "problem", problems, warnings}. A silent topic is a warning: the doctor does not
 * look at messages.
 */
export function verdictOf(findings, topics) {
  const problems = findings.filter(({ status }) => status === "problem").length;
  const warnings =
    findings.filter(({ status }) => status === "warning").length +
    topics.filter(({ state }) => state === "silent").length;
  return { level: problems ? "problem" : warnings ? "warning" : "good", problems, warnings };
}

/** Return the view that shows more of a finding, as [view, settings]; null if there is none. */
export function viewOf({ check, text }) {
  if (check === "nodes") {
    const node = /^(\/[^\s,:]+)/.exec(text)?.[1];
    return ["nodes", node ? { node } : {}];
  }
  if (check === "topics") {
    const topic = /(\/[^\s,:(]+)/.exec(text)?.[1];
    return topic ? ["graph", {}] : ["topics", {}];
  }
  return { connections: ["graph", {}], services: ["services", {}], frames: ["tf", {}] }[check] ?? null;
}

/**
 * Return the lines to show of a log: the newest, and the newest warnings and errors even if many lines came since.
 */
export function linesToShow(lines, most, mostWarnings) {
  const newest = lines.slice(-most);
  const warnings = lines
    .slice(0, lines.length - newest.length)
    .filter(({ level }) => level >= 4)
    .slice(-mostWarnings);
  return [...warnings, ...newest];
}
