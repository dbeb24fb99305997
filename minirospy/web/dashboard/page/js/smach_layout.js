// Containers of smach, laid out from the inside out: a container is a node of the one around it. Pure, but for the
// layout given.

const PAD = 14;
const TITLE = 30;
const LEAF_HEIGHT = 38;

/** Return the outermost containers: those whose path is in no other's children. */
export function roots(structures) {
  const inside = new Set();
  for (const { path, children } of structures.values()) for (const child of children) inside.add(`${path}/${child}`);
  return [...structures.keys()].filter((path) => !inside.has(path)).sort();
}

/** Return the active states of a status; smach publishes "None" if a container has ended. */
export function activeOf({ active_states: names }) {
  return names.filter((name) => name !== "None" && name !== "");
}

/** Return the paths of the active states: a container's last status counts while the container is active itself. */
export function activeStates(structures, statuses) {
  const found = new Set();
  const visit = (path) => {
    for (const name of statuses.has(path) ? activeOf(statuses.get(path)) : []) {
      const inner = `${path}/${name}`;
      if (found.has(inner)) continue;
      found.add(inner);
      visit(inner);
    }
  };
  for (const path of roots(structures)) visit(path);
  return found;
}

/**
 * Return {path, width, height, states, outcomes, edges} of a container; states have x, y (centers), width, height, and
 * `inner` if they are containers that are open.
 */
export function layoutContainer(
  path,
  structures,
  { Graph, layout, widthOf, isFolded = (_path) => false },
  around = new Set(),
) {
  const {
    children,
    internal_outcomes: labels,
    outcomes_from: from,
    outcomes_to: to,
    container_outcomes: ends,
  } = structures.get(path);
  const graph = new Graph({ multigraph: true });
  graph.setGraph({ rankdir: "TB", nodesep: 26, ranksep: 44, marginx: PAD, marginy: PAD });
  const within = new Set([...around, path]);
  const inner = new Map();
  for (const child of children) {
    const childPath = `${path}/${child}`;
    if (structures.has(childPath) && !within.has(childPath) && !isFolded(childPath)) {
      inner.set(child, layoutContainer(childPath, structures, { Graph, layout, widthOf, isFolded }, within));
    }
    const found = inner.get(child);
    graph.setNode(
      `s${child}`,
      found
        ? { width: found.width, height: found.height }
        : { width: Math.max(70, widthOf(child) + 34), height: LEAF_HEIGHT },
    );
  }
  const states = new Set(children);
  const outcomes = new Set(ends);
  const edges = [];
  labels.forEach((label, index) => {
    const source = from[index];
    const target = to[index];
    if (!states.has(source) || (!states.has(target) && !outcomes.has(target))) return;
    edges.push([`s${source}`, `${states.has(target) ? "s" : "o"}${target}`, label]);
  });
  for (const outcome of ends) graph.setNode(`o${outcome}`, { width: widthOf(outcome) + 26, height: 26 });
  edges.forEach(([source, target, label], index) =>
    graph.setEdge(
      source,
      target,
      { label, width: widthOf(label) * 0.85 + 8, height: 18, labelpos: "c" },
      String(index),
    ),
  );
  layout(graph);
  const { width, height } = graph.graph();
  const size = {
    width: Math.max(Number.isFinite(width) ? width : 0, widthOf(path) + 4 * PAD),
    height: (Number.isFinite(height) ? height : 0) + TITLE,
  };
  const shift = (size.width - (Number.isFinite(width) ? width : 0)) / 2;
  const placed = (key) => {
    const { x, y, width: w, height: tall } = graph.node(key);
    return { x: x + shift, y: y + TITLE, width: w, height: tall };
  };
  return {
    path,
    ...size,
    states: children.map((name) => ({
      name,
      ...placed(`s${name}`),
      inner: inner.get(name) ?? null,
      isContainer: structures.has(`${path}/${name}`),
    })),
    outcomes: ends.map((name) => ({ name, ...placed(`o${name}`) })),
    edges: graph.edges().map((id) => {
      const { points, label, x, y } = graph.edge(id);
      return {
        from: id.v.slice(1),
        to: id.w.slice(1),
        loop: id.v === id.w ? placed(id.v) : null,
        label,
        x: x + shift,
        y: y + TITLE,
        points: points.map((point) => ({ x: point.x + shift, y: point.y + TITLE })),
      };
    }),
  };
}
