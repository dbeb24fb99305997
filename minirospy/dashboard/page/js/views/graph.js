// Who sends to whom: nodes and topics, laid out by dagre and drawn as SVG. A click shows the details.

import { Graph as Layered, layout } from "../../vendor/dagre/dagre.esm.js";
import { bandwidth, fill, h, svg, uniqueId } from "../dom.js";
import { Rate } from "../rates.js";

const MODES = [["active", "Nodes and topics (active)"], ["all", "Nodes and topics (all)"], ["nodes", "Nodes only"]];
const DEBUG_TOPICS = new Set(["/rosout", "/rosout_agg", "/statistics"]);
const DEBUG_NODES = /^\/(rosout|rqt_|minirospy_dashboard_|minirospy_bridge|foxglove_bridge|rosbridge_|rosapi|record_|rosbag_|play_)/;
const HEIGHT = 36;

export class Graph {
  constructor(link, words, main, place) {
    this.link = link;
    this.place = place;
    this.selected = null;
    this.signature = null;
    this.end = null;
    this.mode = h("select", { "aria-label": "What is shown", onchange: () => this.change() }, MODES.map(([value, name]) => h("option", { value }, name)));
    this.hidesDebug = h("input", { type: "checkbox", checked: words.get("debug") !== "1", onchange: () => this.change() });
    if (MODES.some(([value]) => value === words.get("mode"))) this.mode.value = words.get("mode");
    this.filter = h("input", { type: "search", placeholder: "Filter names", "aria-label": "Filter", value: words.get("filter") ?? "", oninput: () => this.change() });
    this.arrow = uniqueId("arrow");
    this.drawing = svg("g", {});
    this.picture = svg("svg", { class: "graph", role: "group", "aria-label": "Graph of nodes and topics" },
      svg("defs", {}, svg("marker", { id: this.arrow, viewBox: "0 0 10 10", refX: 9, refY: 5, markerWidth: 7, markerHeight: 7, orient: "auto-start-reverse" },
        svg("path", { d: "M0 0 10 5 0 10z", class: "head" }))), this.drawing);
    this.details = h("aside", { class: "panel details side", hidden: true });
    this.empty = h("p", { class: "empty" });
    main.append(h("div", { class: "bar" }, this.mode, h("label", {}, this.hidesDebug, "hide debug"), this.filter,
      h("button", { type: "button", onclick: () => this.fit() }, "Fit")),
    h("div", { class: "split" }, h("div", { class: "panel canvas" }, this.picture, this.empty), this.details));
    this.view = { x: 0, y: 0, scale: 1 };
    this.isFitted = true;
    this.pointers = new Map();
    this.listen();
    this.observer = new ResizeObserver(() => { if (this.isFitted) this.fit(); });
    this.observer.observe(this.picture);
    this.ending = link.watch(["graph", "channels", "state"], () => this.update());
  }

  close() {
    this.ending();
    this.observer.disconnect();
    this.endRate();
  }

  /** Return what is shown: {nodes: Set, topics: Set, edges: [from, to, label]}; keys are n/NAME and t/NAME. */
  elements() {
    const { published, subscribed, services } = this.link.graph;
    const isHidden = this.hidesDebug.checked;
    const words = this.filter.value.toLowerCase();
    const isNode = (name) => !(isHidden && (DEBUG_NODES.test(name) || name === this.link.node));
    const nodes = new Set();
    const topics = new Set();
    const edges = [];
    for (const names of [...published.values(), ...subscribed.values(), ...services.values()]) for (const name of names) if (isNode(name)) nodes.add(name);
    for (const topic of new Set([...published.keys(), ...subscribed.keys()])) {
      if (isHidden && DEBUG_TOPICS.has(topic)) continue;
      const from = (published.get(topic) ?? []).filter(isNode);
      const to = (subscribed.get(topic) ?? []).filter(isNode);
      const isActive = from.length && to.length;
      if (this.mode.value === "nodes") {
        for (const a of from) for (const b of to) edges.push([`n${a}`, `n${b}`, topic]);
      } else if (isActive || (this.mode.value === "all" && from.length + to.length)) {
        topics.add(topic);
        for (const a of from) edges.push([`n${a}`, `t${topic}`, ""]);
        for (const b of to) edges.push([`t${topic}`, `n${b}`, ""]);
      }
    }
    if (words) {
      const fits = (key) => key.slice(1).toLowerCase().includes(words);
      const kept = new Set();
      for (const [from, to, label] of edges) if (fits(from) || fits(to) || label.includes(words)) kept.add(from).add(to);
      for (const name of nodes) if (!kept.has(`n${name}`) && !fits(`n${name}`)) nodes.delete(name);
      for (const name of topics) if (!kept.has(`t${name}`)) topics.delete(name);
    }
    const isThere = (key) => (key[0] === "n" ? nodes : topics).has(key.slice(1));
    return { nodes, topics, edges: edges.filter(([from, to]) => isThere(from) && isThere(to)) };
  }

  change() {
    this.place.remember({ mode: this.mode.value === MODES[0][0] ? "" : this.mode.value, debug: !this.hidesDebug.checked, filter: this.filter.value });
    this.update();
  }

  update() {
    // While the connection is lost, the last graph stays.
    if (this.link.state !== "open" && this.signature !== null) return;
    const found = this.elements();
    const signature = JSON.stringify([[...found.nodes].sort(), [...found.topics].sort(), found.edges]);
    if (signature !== this.signature) {
      this.signature = signature;
      this.draw(found);
    }
    this.empty.textContent = found.nodes.size ? "" : this.link.state === "open" ? "No nodes yet. Start one: it appears here." : "";
    if (this.selected) this.showDetails();
  }

  draw({ nodes, topics, edges }) {
    const graph = new Layered({ multigraph: true });
    graph.setGraph({ rankdir: "LR", nodesep: 22, ranksep: 70, marginx: 12, marginy: 12 });
    const measure = h("canvas").getContext("2d");
    measure.font = "600 14px system-ui, sans-serif";
    for (const [kind, names] of [["n", nodes], ["t", topics]]) {
      for (const name of [...names].sort()) {
        graph.setNode(kind + name, { width: measure.measureText(name).width + (kind === "n" ? 44 : 26), height: HEIGHT });
      }
    }
    measure.font = "12px system-ui, sans-serif";
    edges.forEach(([from, to, label], index) => graph.setEdge(from, to, label ? { label, width: measure.measureText(label).width, height: 16, labelpos: "c" } : {}, String(index)));
    layout(graph);
    const parts = [];
    for (const id of graph.edges()) {
      const { points, label, x, y } = graph.edge(id);
      const path = points.map((point, index) => `${index ? "L" : "M"}${point.x.toFixed(1)} ${point.y.toFixed(1)}`).join("");
      const edge = svg("g", { class: "edge" }, svg("path", { d: path, "marker-end": `url(#${this.arrow})` }), label ? svg("text", { x, y: y + 4 }, label) : null);
      edge.dataset.from = id.v;
      edge.dataset.to = id.w;
      parts.push(edge);
    }
    for (const key of graph.nodes()) {
      const { x, y, width, height } = graph.node(key);
      const shape = { x: x - width / 2, y: y - height / 2, width, height, rx: key[0] === "n" ? height / 2 : 4 };
      const select = () => this.select(key);
      const part = svg("g", { class: key[0] === "n" ? "node" : "topic", tabindex: 0, role: "button", "aria-label": `${key[0] === "n" ? "node" : "topic"} ${key.slice(1)}`,
        onclick: select, onkeydown: (event) => { if (event.key === "Enter" || event.key === " ") select(); } },
      svg("rect", shape), svg("text", { x, y: y + 5 }, key.slice(1)));
      part.dataset.key = key;
      parts.push(part);
    }
    this.drawing.replaceChildren(...parts);
    const { width, height } = graph.graph();
    this.size = { width: Number.isFinite(width) ? width : 1, height: Number.isFinite(height) ? height : 1 };
    if (this.isFitted) this.fit();
    this.highlight();
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
      if (key) continue;
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
    const names = (table) => [...table].filter(([, nodes]) => nodes.includes(name)).map(([each]) => each).sort();
    // A button that is replaced between press and release loses its click.
    const content = JSON.stringify([published, subscribed, services].flatMap((table) => [names(table), table.get(name) ?? []]).concat(this.link.channels.get(name)?.type ?? ""));
    if (content === this.shown) return;
    this.shown = content;
    const list = (title, items, kind) => (items.length ? [h("h3", {}, `${title} (${items.length})`), h("ul", {}, items.map((each) => h("li", {}, kind
      ? h("button", { type: "button", class: "link", onclick: () => { this.selected = null; this.select(kind + each); } }, each) : each)))] : []);
    if (this.selected[0] === "n") {
      fill(this.details, h("h2", {}, name), list("Publishes", names(published), "t"), list("Subscribes to", names(subscribed), "t"), list("Services", names(services)));
    } else {
      const type = this.link.channels.get(name)?.type;
      this.rateText ??= h("span", { class: "muted" });
      fill(this.details, h("h2", {}, name), h("p", {}, type ?? "its type is not known yet", " ", this.rateText),
        h("p", {}, h("a", { href: `#/topics?open=${encodeURIComponent(name)}` }, "live values")),
        list("Publishers", published.get(name) ?? [], "n"), list("Subscribers", subscribed.get(name) ?? [], "n"),
        (published.get(name) ?? []).length ? null : h("p", { class: "error" }, "Nobody publishes this topic."));
    }
  }

  measure(topic) {
    const rate = new Rate();
    const end = this.link.subscribe({ topic, mode: "latest", isCounted: true }, (item) => rate.add(performance.now() / 1000, item.count ?? 0, item.bytes ?? 0));
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

  // --- pan and zoom

  fit() {
    this.isFitted = true;
    const { clientWidth, clientHeight } = this.picture;
    if (!this.size || !clientWidth) return;
    const scale = Math.min(1.4, clientWidth / this.size.width, clientHeight / this.size.height);
    this.view = { scale, x: (clientWidth - this.size.width * scale) / 2, y: (clientHeight - this.size.height * scale) / 2 };
    this.move();
  }

  move() {
    const { x, y, scale } = this.view;
    this.drawing.setAttribute("transform", `translate(${x.toFixed(2)} ${y.toFixed(2)}) scale(${scale.toFixed(4)})`);
  }

  zoom(factor, x, y) {
    const scale = Math.min(4, Math.max(0.05, this.view.scale * factor));
    const real = scale / this.view.scale;
    this.view = { scale, x: x - (x - this.view.x) * real, y: y - (y - this.view.y) * real };
    this.isFitted = false;
    this.move();
  }

  listen() {
    this.picture.addEventListener("wheel", (event) => {
      event.preventDefault();
      const box = this.picture.getBoundingClientRect();
      this.zoom(Math.exp(-event.deltaY * 0.0015), event.clientX - box.left, event.clientY - box.top);
    }, { passive: false });
    this.picture.addEventListener("pointerdown", (event) => this.pointers.set(event.pointerId, event));
    this.picture.addEventListener("pointermove", (event) => {
      const before = this.pointers.get(event.pointerId);
      if (!before) return;
      if (this.pointers.size === 2) {
        const other = [...this.pointers.values()].find((each) => each.pointerId !== event.pointerId);
        const distance = (each) => Math.hypot(each.clientX - other.clientX, each.clientY - other.clientY);
        const box = this.picture.getBoundingClientRect();
        this.zoom(distance(event) / Math.max(1, distance(before)), (event.clientX + other.clientX) / 2 - box.left, (event.clientY + other.clientY) / 2 - box.top);
      } else if (this.pointers.size === 1) {
        this.view.x += event.clientX - before.clientX;
        this.view.y += event.clientY - before.clientY;
        this.isFitted = false;
        this.move();
      }
      this.pointers.set(event.pointerId, event);
    });
    for (const name of ["pointerup", "pointercancel", "pointerleave"]) this.picture.addEventListener(name, (event) => this.pointers.delete(event.pointerId));
  }
}
