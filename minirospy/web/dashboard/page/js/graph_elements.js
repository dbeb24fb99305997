// What the graph shows: nodes, topics, actions folded into one, groups by namespace, and the traffic of what is drawn.
// Pure.

const DEBUG_TOPICS = new Set(["/rosout", "/rosout_agg", "/statistics"]);
const DEBUG_NODES =
  /^\/(rosout|rqt_|minirospy_dashboard_|minirospy_bridge|foxglove_bridge|rosbridge_|rosapi|record_|rosbag_|play_)/;
const TO_SERVER = ["goal", "cancel"];
const FROM_SERVER = ["status", "feedback", "result"];

/** Return the names of the actions among topics. */
export function actionsIn(topics) {
  const known = new Set(topics);
  return [...known]
    .filter((topic) => topic.endsWith("/goal"))
    .map((topic) => topic.slice(0, -"/goal".length))
    .filter((name) => ["cancel", ...FROM_SERVER].every((part) => known.has(`${name}/${part}`)))
    .sort();
}

/**
 * Return what is shown, {nodes, topics, actions: Sets of names, edges: [{from, to, label, pairs}]}; keys are n/NAME,
 * t/NAME, a/NAME.
 * ``pairs`` are the connections of an edge: [topic, sender or null, receiver or null].
 */
export function elementsOf({ published, subscribed, services }, { mode, hidesDebug, filter, ownNode, folds }) {
  const isNode = (name) => !(hidesDebug && (DEBUG_NODES.test(name) || name === ownNode));
  const nodes = new Set();
  const topics = new Set();
  const edges = [];
  for (const names of [...published.values(), ...subscribed.values(), ...services.values()])
    for (const name of names) if (isNode(name)) nodes.add(name);
  const all = new Set([...published.keys(), ...subscribed.keys()]);
  const actions = folds ? actionsIn(all) : [];
  const folded = new Set(actions.flatMap((name) => [...TO_SERVER, ...FROM_SERVER].map((part) => `${name}/${part}`)));
  const shownActions = new Set();
  const ends = (topic) => [(published.get(topic) ?? []).filter(isNode), (subscribed.get(topic) ?? []).filter(isNode)];

  for (const topic of all) {
    if (folded.has(topic) || (hidesDebug && DEBUG_TOPICS.has(topic))) continue;
    const [from, to] = ends(topic);
    if (mode === "nodes") {
      for (const a of from)
        for (const b of to) edges.push({ from: `n${a}`, to: `n${b}`, label: topic, pairs: [[topic, a, b]] });
    } else if ((from.length && to.length) || (mode === "all" && from.length + to.length)) {
      topics.add(topic);
      for (const a of from) edges.push({ from: `n${a}`, to: `t${topic}`, label: "", pairs: [[topic, a, null]] });
      for (const b of to) edges.push({ from: `t${topic}`, to: `n${b}`, label: "", pairs: [[topic, null, b]] });
    }
  }

  for (const name of actions) {
    const found = actionEdges(name, ends, mode);
    if (!found.length) continue;
    if (mode !== "nodes") shownActions.add(name);
    edges.push(...found);
  }
  return filtered({ nodes, topics, actions: shownActions, edges }, filter.toLowerCase());
}

/** Return the edges of an action: from those that send goals to its servers, and to those that only look. */
function actionEdges(name, ends, mode) {
  const servers = new Set(ends(`${name}/status`)[0]);
  const clients = new Set(TO_SERVER.flatMap((part) => ends(`${name}/${part}`)[0]));
  const watchers = new Set(
    FROM_SERVER.flatMap((part) => ends(`${name}/${part}`)[1]).filter(
      (node) => !clients.has(node) && !servers.has(node),
    ),
  );
  const of = (parts, sender, receiver) => parts.map((part) => [`${name}/${part}`, sender, receiver]);
  const found = [];
  if (mode === "nodes") {
    for (const server of servers) {
      for (const client of clients)
        found.push({
          from: `n${client}`,
          to: `n${server}`,
          label: `${name} (action)`,
          pairs: [...of(TO_SERVER, client, server), ...of(FROM_SERVER, server, client)],
        });
      for (const watcher of watchers)
        found.push({
          from: `n${server}`,
          to: `n${watcher}`,
          label: `${name} (action)`,
          pairs: of(FROM_SERVER, server, watcher),
        });
    }
    return found;
  }
  for (const client of clients)
    found.push({
      from: `n${client}`,
      to: `a${name}`,
      label: "",
      pairs: [...of(TO_SERVER, client, null), ...of(FROM_SERVER, null, client)],
    });
  for (const server of servers)
    found.push({
      from: `a${name}`,
      to: `n${server}`,
      label: "",
      pairs: [...of(TO_SERVER, null, server), ...of(FROM_SERVER, server, null)],
    });
  for (const watcher of watchers)
    found.push({ from: `a${name}`, to: `n${watcher}`, label: "", pairs: of(FROM_SERVER, null, watcher) });
  return found;
}

function filtered({ nodes, topics, actions, edges }, words) {
  const tables = { n: nodes, t: topics, a: actions };
  if (words) {
    const fits = (key) => key.slice(1).toLowerCase().includes(words);
    const kept = new Set();
    for (const { from, to, label } of edges)
      if (fits(from) || fits(to) || label.toLowerCase().includes(words)) kept.add(from).add(to);
    for (const [kind, table] of Object.entries(tables))
      for (const name of table) if (!kept.has(kind + name) && !(kind === "n" && fits(kind + name))) table.delete(name);
  }
  const isThere = (key) => tables[key[0]].has(key.slice(1));
  return { nodes, topics, actions, edges: edges.filter(({ from, to }) => isThere(from) && isThere(to)) };
}

/** Return the namespaces that hold several of these keys, and the keys of each: Map of name -> keys. */
export function groupsOf(keys) {
  const found = new Map();
  for (const key of keys) {
    const parts = key.slice(2).split("/");
    if (parts.length < 2) continue;
    found.set(parts[0], [...(found.get(parts[0]) ?? []), key]);
  }
  return new Map([...found].filter(([, members]) => members.length > 1));
}

/**
 * Return Map of key -> the keys that it is connected with, one list for all of them; each of ``links`` is keys that
 * belong together.
 */
export function connectedOf(keys, links) {
  const found = new Map(keys.map((key) => [key, [key]]));
  for (const [first, ...others] of links) {
    for (const other of others) {
      const [less, more] = [found.get(first), found.get(other)].sort((one, two) => one.length - two.length);
      if (less === more) continue;
      for (const key of less) {
        found.set(key, more);
        more.push(key);
      }
    }
  }
  return found;
}

/**
 * Put boxes in rows, the highest first, so that all are as large as they can be in a view of this aspect: {width,
 * height, places: [{x, y}]}.
 */
export function packed(boxes, aspect) {
  const order = [...boxes.keys()].sort((one, other) => boxes[other].height - boxes[one].height);
  const widest = Math.max(0, ...boxes.map(({ width }) => width));
  let best = { width: 0, height: 0, places: [] };
  let [most, least] = [0, Infinity];
  order.forEach((last, index) => {
    most += boxes[last].width;
    for (const limit of [Math.max(most, widest), (index + 1) * widest]) {
      const found = inRows(boxes, order, limit);
      const size = Math.max(found.width, found.height * aspect);
      if (size < least) [best, least] = [found, size];
    }
  });
  return best;
}

function inRows(boxes, order, most) {
  const places = [];
  let [x, y, next, width] = [0, 0, 0, 0];
  for (const index of order) {
    const box = boxes[index];
    if (x && x + box.width > most) [x, y] = [0, next];
    places[index] = { x, y };
    x += box.width;
    width = Math.max(width, x);
    next = Math.max(next, y + box.height);
  }
  return { width, height: next, places };
}

/**
 * Return the traffic of an edge by a report's rows [sender, topic, receiver, hz, bytes], {hz, bytes}; null where
 * nothing is known.
 * A message to three receivers is one message: of those of one sender the fastest counts.
 */
export function trafficOf({ pairs }, rows) {
  const senders = new Map();
  let bytes = 0;
  for (const [topic, from, to] of pairs) {
    for (const [sender, name, receiver, hz, size] of rows) {
      if (name !== topic || (from !== null && sender !== from) || (to !== null && receiver !== to)) continue;
      const key = `${sender} ${name}`;
      senders.set(key, Math.max(senders.get(key) ?? 0, hz));
      bytes += size;
    }
  }
  return senders.size ? { hz: [...senders.values()].reduce((sum, each) => sum + each, 0), bytes } : null;
}
