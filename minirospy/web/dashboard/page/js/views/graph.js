// Who sends to whom: nodes and topics, laid out by dagre and drawn as SVG. A click shows the details.

import { Graph as Layered, layout } from "../../vendor/dagre/dagre.esm.js";
import { aroundLabel, brief, loopOf, pathOf } from "../drawing.js";
import { bandwidth, h, redraw, refill, setText, svg, uniqueId } from "../dom.js";
import { connectedOf, elementsOf, groupsOf, packed, trafficOf } from "../graph_elements.js";
import { PanZoom } from "../panzoom.js";
import { Rate } from "../rates.js";
import { t } from "../texts.js";

const MODES = [
  ["active", "Nodes and topics (active)"],
  ["all", "Nodes and topics (all)"],
  ["nodes", "Nodes only"],
];
const SHAPES = { n: "node", t: "topic", a: "action" };
const HEIGHT = 36;
const MAX_TRIED = 150; // nodes and topics that are laid out in two ways
const LABEL_GAP = 6; // pixels between a line that runs downwards and its label
const RATE_TEXT = "000.0 kB/s"; // for which an edge has room

export class Graph {
  constructor(link, words, main, place) {
    this.link = link;
    this.place = place;
    this.selected = null;
    this.signature = null;
    this.end = null;
    this.mode = h(
      "select",
      { "aria-label": "What is shown", onchange: () => this.change() },
      MODES.map(([value, name]) => h("option", { value }, name)),
    );
    this.hidesDebug = h("input", {
      type: "checkbox",
      checked: words.get("debug") !== "1",
      onchange: () => this.change(),
    });
    if (MODES.some(([value]) => value === words.get("mode"))) this.mode.value = words.get("mode");
    this.filter = h("input", {
      type: "search",
      placeholder: "Filter names",
      "aria-label": "Filter",
      value: words.get("filter") ?? "",
      oninput: () => this.change(),
    });
    this.arrow = uniqueId("arrow");
    this.drawing = svg("g", {});
    this.picture = svg(
      "svg",
      { class: "graph", role: "group", "aria-label": "Graph of nodes and topics" },
      svg(
        "defs",
        {},
        svg(
          "marker",
          {
            id: this.arrow,
            viewBox: "0 0 10 10",
            refX: 9,
            refY: 5,
            markerWidth: 7,
            markerHeight: 7,
            orient: "auto-start-reverse",
          },
          svg("path", { d: "M0 0 10 5 0 10z", class: "head" }),
        ),
      ),
      this.drawing,
    );
    this.details = h("aside", { class: "panel details side", hidden: true });
    this.empty = h("p", { class: "empty" });
    this.hasRates = h("input", {
      type: "checkbox",
      checked: words.get("rates") !== "0",
      onchange: () => this.change(),
    });
    this.hasGroups = h("input", {
      type: "checkbox",
      checked: words.get("groups") === "1",
      onchange: () => this.change(),
    });
    this.folds = h("input", { type: "checkbox", checked: words.get("fold") !== "0", onchange: () => this.change() });
    this.faults = h("span", { class: "error", role: "status" });
    main.append(
      h(
        "div",
        { class: "bar" },
        this.mode,
        h("label", {}, this.hidesDebug, "hide debug"),
        h("label", {}, this.hasRates, t("rates")),
        h("label", {}, this.folds, "fold actions"),
        h("label", {}, this.hasGroups, t("namespaces")),
        this.filter,
        h("button", { type: "button", onclick: () => this.panzoom.fit() }, "Fit"),
        this.faults,
      ),
      h("div", { class: "split" }, h("div", { class: "panel canvas" }, this.picture, this.empty), this.details),
    );
    this.panzoom = new PanZoom(this.picture, this.drawing);
    this.report = { nodes: [], traffic: [], mismatches: {} };
    this.drawn = [];
    this.endings = [
      link.watch(["graph", "channels", "state"], () => this.update()),
      link.tools.watch((report) => this.reported(report)),
    ];
  }

  close() {
    for (const end of this.endings) end();
    this.panzoom.close();
    this.endRate();
  }

  elements() {
    return elementsOf(this.link.graph, {
      mode: this.mode.value,
      hidesDebug: this.hidesDebug.checked,
      filter: this.filter.value,
      ownNode: this.link.node,
      folds: this.folds.checked,
    });
  }

  change() {
    this.place.remember({
      mode: this.mode.value === MODES[0][0] ? "" : this.mode.value,
      debug: !this.hidesDebug.checked,
      filter: this.filter.value,
      rates: this.hasRates.checked ? "" : "0",
      groups: this.hasGroups.checked,
      fold: this.folds.checked ? "" : "0",
    });
    this.update();
  }

  update() {
    // While the connection is lost, the last graph stays.
    if (this.link.state !== "open" && this.signature !== null) return;
    const found = this.elements();
    const signature = JSON.stringify([
      [...found.nodes].sort(),
      [...found.topics].sort(),
      [...found.actions].sort(),
      found.edges,
      this.hasRates.checked,
      this.hasGroups.checked,
    ]);
    if (signature !== this.signature) {
      redraw(this.drawing, () => {
        this.signature = signature;
        this.draw(found);
      });
    }
    this.empty.textContent = found.nodes.size
      ? ""
      : this.link.state === "open"
        ? t("No nodes yet. Start one: it appears here.")
        : "";
    if (this.selected) this.showDetails();
  }

  /** Take over what the nodes report of themselves: their traffic, those that are dead, types that differ. */
  reported(report) {
    if (!report.nodes) return;
    this.report = report;
    this.showReport();
    if (this.selected) this.showDetails();
  }

  showReport() {
    const dead = new Map(this.report.nodes.filter(({ trouble }) => trouble).map((node) => [`n${node.name}`, node]));
    const { mismatches } = this.report;
    for (const part of this.drawing.querySelectorAll("[data-key]")) {
      const { key } = part.dataset;
      part.classList.toggle("bad", dead.has(key) || (key[0] === "t" && Object.hasOwn(mismatches, key.slice(1))));
    }
    const texts = [
      dead.size ? t(dead.size === 1 ? "{count} dead node" : "{count} dead nodes", { count: dead.size }) : "",
      ...Object.keys(mismatches)
        .slice(0, 2)
        .map((topic) => t("{topic} has two types", { topic })),
    ];
    setText(this.faults, texts.filter(Boolean).join(", "));
    for (const { above, below, edge } of this.drawn) {
      const found = this.hasRates.checked ? trafficOf(edge, this.report.traffic) : null;
      setText(above, found ? `${found.hz.toFixed(1)} Hz` : "");
      setText(below, found ? bandwidth(found.bytes) : "");
    }
  }

  draw(found) {
    const layouts = [this.lay(found, "LR")];
    // A chain of nodes is easier to read from top to bottom if the view is not as wide as it.
    if (found.nodes.size + found.topics.size < MAX_TRIED) layouts.push(this.lay(found, "TB"));
    const [{ width, height, boxes, edges }] = layouts.sort((one, other) => this.fitOf(other) - this.fitOf(one));
    const groups = [...boxes].filter(([key]) => key[0] === "g").map(([key, box]) => this.makeGroup(key.slice(1), box));
    this.drawn = [];
    const lines = edges.map(([id, edge]) => this.makeEdge(edge, id, found.edges, boxes.get(id.v)));
    const parts = [...boxes].filter(([key]) => SHAPES[key[0]]).map(([key, box]) => this.makePart(key, box));
    this.drawing.replaceChildren(...groups, ...lines, ...parts);
    this.panzoom.resized(width, height);
    this.showReport();
    this.highlight();
  }

  /** Return by how much a drawing can be enlarged in the view. */
  fitOf({ width, height }) {
    const view = this.viewSize();
    return Math.min(1, view.width / width, view.height / height);
  }

  viewSize() {
    return { width: this.picture.clientWidth || 1000, height: this.picture.clientHeight || 600 };
  }

  /** Lay out each connected part, and put them in rows. */
  lay({ nodes, topics, actions, edges }, rankdir) {
    const keys = [
      ["n", nodes],
      ["t", topics],
      ["a", actions],
    ].flatMap(([kind, names]) => [...names].sort().map((name) => kind + name));
    const groups = this.hasGroups.checked ? groupsOf(keys) : new Map();
    const connected = connectedOf(keys, [...edges.map(({ from, to }) => [from, to]), ...groups.values()]);
    const parts = new Map();
    const partOf = (key) => parts.get(connected.get(key));
    for (const part of connected.values()) {
      if (parts.has(part)) continue;
      parts.set(
        part,
        new Layered({ multigraph: true, compound: true }).setGraph({
          rankdir,
          nodesep: 22,
          ranksep: this.hasRates.checked ? 30 : 60,
          marginx: 12,
          marginy: this.hasGroups.checked ? 26 : 12,
        }),
      );
    }
    const measure = h("canvas").getContext("2d");
    measure.font = "600 14px system-ui, sans-serif";
    for (const key of keys)
      partOf(key).setNode(key, {
        width: measure.measureText(brief(key.slice(1))).width + (key[0] === "t" ? 26 : 44),
        height: HEIGHT,
      });
    for (const [name, members] of groups) {
      partOf(members[0]).setNode(`g${name}`, {});
      for (const key of members) partOf(key).setParent(key, `g${name}`);
    }
    measure.font = "12px system-ui, sans-serif";
    const room = this.hasRates.checked ? measure.measureText(RATE_TEXT).width : 0;
    edges.forEach(({ from, to, label }, index) => {
      const text = Math.max(label ? measure.measureText(brief(label)).width : 0, room);
      const width = rankdir === "LR" ? text : 2 * (text && text + LABEL_GAP); // downwards, the text is right of the line
      partOf(from).setEdge(
        from,
        to,
        width ? { width, height: label ? 50 : 34, labelpos: "c", index, isLevel: rankdir === "LR" } : { index },
        String(index),
      );
    });
    const graphs = [...parts.values()];
    for (const graph of graphs) layout(graph);
    const view = this.viewSize();
    const { places, ...size } = packed(
      graphs.map((graph) => graph.graph()),
      view.width / view.height,
    );
    const found = { ...size, boxes: new Map(), edges: [] };
    graphs.forEach((graph, index) => {
      const moved = (point) => Object.assign(point, { x: point.x + places[index].x, y: point.y + places[index].y });
      for (const key of graph.nodes()) found.boxes.set(key, moved(graph.node(key)));
      for (const id of graph.edges()) {
        const edge = graph.edge(id);
        edge.points.forEach(moved);
        found.edges.push([id, edge.x === undefined ? edge : moved(edge)]);
      }
    });
    return found;
  }

  makeGroup(name, { x, y, width, height }) {
    return svg(
      "g",
      { class: "namespace near" },
      svg("rect", { x: x - width / 2, y: y - height / 2, width, height, rx: 8 }),
      svg("text", { x: x - width / 2 + 8, y: y - height / 2 - 4 }, brief(`/${name}`)),
    );
  }

  makeEdge({ points, x: center, y, width, height, index, isLevel }, id, edges, box) {
    const edge = edges[index];
    const hasText = center !== undefined;
    const isLoop = id.v === id.w && hasText;
    const label = { x: center, y, width, height };
    const path = isLoop ? loopOf(box, label) : pathOf(hasText ? aroundLabel(points, label, isLevel) : points);
    const isBeside = hasText && !isLevel && !isLoop;
    const x = isBeside ? center + LABEL_GAP : center;
    const part = svg(
      "g",
      { class: isBeside ? "edge beside" : "edge" },
      svg("path", { d: path, "marker-end": `url(#${this.arrow})` }),
      hasText && edge.label ? [svg("title", {}, edge.label), svg("text", { x, y: y - 6 }, brief(edge.label))] : null,
    );
    if (hasText) {
      const above = svg("text", { class: "traffic", x, y: edge.label ? y + 15 : y - 6 });
      const below = svg("text", { class: "traffic", x, y: edge.label ? y + 29 : y + 15 });
      this.drawn.push({ above, below, edge });
      part.append(above, below);
    }
    part.dataset.from = id.v;
    part.dataset.to = id.w;
    return part;
  }

  makePart(key, { x, y, width, height }) {
    const kind = SHAPES[key[0]];
    const shape = {
      x: x - width / 2,
      y: y - height / 2,
      width,
      height,
      rx: key[0] === "n" ? height / 2 : key[0] === "a" ? 12 : 4,
    };
    const select = () => this.select(key);
    const part = svg(
      "g",
      {
        class: kind,
        tabindex: 0,
        role: "button",
        "aria-label": `${t(kind)} ${key.slice(1)}`,
        onclick: select,
        onkeydown: (event) => {
          if (event.key !== "Enter" && event.key !== " ") return;
          event.preventDefault(); // the page would scroll
          select();
        },
      },
      svg("title", {}, key.slice(1)),
      svg("rect", shape),
      svg("text", { x, y: y + 5 }, brief(key.slice(1))),
    );
    part.dataset.key = key;
    return part;
  }

  select(key) {
    this.selected = this.selected === key ? null : key;
    this.endRate();
    if (this.selected?.[0] === "t") this.measure(key.slice(1));
    this.shown = null;
    this.showDetails();
    this.highlight();
  }

  highlight() {
    const near = new Set([this.selected]);
    for (const part of this.drawing.children) {
      const { from, to, key } = part.dataset;
      if (key || !from) continue;
      const isNear = from === this.selected || to === this.selected;
      part.classList.toggle("near", isNear);
      if (isNear) near.add(from).add(to);
    }
    for (const part of this.drawing.children) {
      if (part.dataset.key) part.classList.toggle("near", near.has(part.dataset.key));
      part.classList.toggle("selected", part.dataset.key === this.selected);
    }
    this.drawing.classList.toggle("dimmed", this.selected !== null);
  }

  showDetails() {
    this.details.hidden = !this.selected;
    if (!this.selected) return;
    const name = this.selected.slice(1);
    const { published, subscribed, services } = this.link.graph;
    const names = (table) =>
      [...table]
        .filter(([, nodes]) => nodes.includes(name))
        .map(([each]) => each)
        .sort();
    const content = JSON.stringify(
      [published, subscribed, services]
        .flatMap((table) => [names(table), table.get(name) ?? []])
        .concat(
          this.link.channels.get(name)?.type ?? "",
          this.report.mismatches[name] ?? "",
          this.report.nodes.find((node) => node.name === name)?.trouble ?? "",
        ),
    );
    if (content === this.shown) return;
    this.shown = content;
    const list = (title, items, kind) =>
      items.length
        ? [
            h("h3", {}, `${t(title)} (${items.length})`),
            h(
              "ul",
              {},
              items.map((each) =>
                h(
                  "li",
                  {},
                  kind
                    ? h(
                        "button",
                        {
                          type: "button",
                          class: "link",
                          onclick: () => {
                            this.selected = null;
                            this.select(kind + each);
                          },
                        },
                        each,
                      )
                    : each,
                ),
              ),
            ),
          ]
        : [];
    if (this.selected[0] === "a") {
      const ends = (part, table) => table.get(`${name}/${part}`) ?? [];
      refill(
        this.details,
        h("h2", {}, name),
        h("p", {}, h("a", { href: `#/actions?action=${encodeURIComponent(name)}` }, t("goals, feedback and results"))),
        list("Servers", ends("status", published), "n"),
        list("Clients", [...new Set([...ends("goal", published), ...ends("cancel", published)])], "n"),
        list(
          "Topics",
          ["goal", "cancel", "status", "feedback", "result"].map((part) => `${name}/${part}`),
        ),
      );
    } else if (this.selected[0] === "n") {
      const node = this.report.nodes.find((each) => each.name === name);
      refill(
        this.details,
        h("h2", {}, name),
        node?.trouble
          ? h(
              "p",
              { class: "error" },
              t("It does not answer: {trouble}. What to do: {advice}.", { trouble: node.trouble, advice: node.advice }),
            )
          : null,
        h("p", {}, h("a", { href: `#/nodes?node=${encodeURIComponent(name)}` }, t("process and connections"))),
        list("Publishes", names(published), "t"),
        list("Subscribes to", names(subscribed), "t"),
        list("Services", names(services)),
      );
    } else {
      const type = this.link.channels.get(name)?.type;
      this.rateText ??= h("span", { class: "muted" });
      refill(
        this.details,
        h("h2", {}, name),
        h("p", {}, type ?? "its type is not known yet", " ", this.rateText),
        h("p", {}, h("a", { href: `#/topics?open=${encodeURIComponent(name)}` }, t("live values"))),
        list("Publishers", published.get(name) ?? [], "n"),
        list("Subscribers", subscribed.get(name) ?? [], "n"),
        (published.get(name) ?? []).length ? null : h("p", { class: "error" }, "Nobody publishes this topic."),
        this.mismatch(name),
      );
    }
  }

  measure(topic) {
    const rate = new Rate();
    const end = this.link.subscribe({ topic, mode: "latest", isCounted: true }, (item) =>
      rate.add(performance.now() / 1000, item.count ?? 0, item.bytes ?? 0),
    );
    this.rateText = h("span", { class: "muted" });
    const timer = setInterval(() => {
      const found = rate.at(performance.now() / 1000);
      this.rateText.textContent = found ? `· ${found.hz.toFixed(1)} Hz · ${bandwidth(found.bytes)}` : "";
    }, 500);
    this.end = () => {
      end();
      clearInterval(timer);
    };
  }

  endRate() {
    this.end?.();
    this.end = null;
  }

  /** Return what is wrong with the types of a topic. */
  mismatch(topic) {
    const types = this.report.mismatches[topic];
    if (!types) return null;
    return h(
      "div",
      { class: "error" },
      h("p", {}, "Its nodes have different types and never connect. Use one type, or two names:"),
      h(
        "ul",
        {},
        Object.entries(types).map(([type, nodes]) => h("li", {}, `${type}: ${nodes.join(", ")}`)),
      ),
    );
  }
}
