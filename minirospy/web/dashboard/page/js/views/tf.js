// The tree of frames: who is whose parent, how often and how lately each is published, and what is wrong.

import { Graph as Layered, layout } from "../../vendor/dagre/dagre.esm.js";
import { brief, pathOf } from "../drawing.js";
import { h, number, redraw, refill, setText, svg } from "../dom.js";
import { Frames, eulerOf } from "../frames.js";
import { PanZoom } from "../panzoom.js";
import { t } from "../texts.js";

const REFRESH_MS = 500;
const HEIGHT = 44;

export class Tf {
  constructor(link, words, main, place) {
    this.link = link;
    this.place = place;
    this.isClosed = false;
    this.frames = new Frames();
    this.chosen = words.get("frame");
    this.boxes = new Map();
    this.filter = h("input", {
      type: "search",
      placeholder: "Find a frame",
      "aria-label": "Find",
      oninput: () => this.highlight(),
    });
    this.summary = h("span", { class: "muted", role: "status" });
    this.problems = h("span", { class: "error" });
    this.drawing = svg("g", {});
    this.picture = svg("svg", { class: "graph tf", role: "group", "aria-label": "Tree of frames" }, this.drawing);
    this.side = h("aside", { class: "panel details side", hidden: true });
    this.empty = h("p", { class: "empty" });
    main.append(
      h(
        "div",
        { class: "bar" },
        this.filter,
        this.summary,
        this.problems,
        h("button", { type: "button", onclick: () => this.panzoom.fit() }, "Fit"),
        h(
          "button",
          {
            type: "button",
            title: "Forget all frames; those that are still published come again",
            onclick: () => this.forget(),
          },
          "Forget",
        ),
      ),
      h("div", { class: "split" }, h("div", { class: "panel canvas" }, this.picture, this.empty), this.side),
    );
    this.panzoom = new PanZoom(this.picture, this.drawing);
    this.subscribe();
    this.ending = link.watch(["channels", "state"], () => this.draw());
    this.timer = setInterval(() => this.draw(), REFRESH_MS);
  }

  close() {
    this.isClosed = true;
    clearInterval(this.timer);
    this.ending();
    this.panzoom.close();
    for (const end of this.ends) end();
  }

  subscribe() {
    const received =
      (isStatic) =>
      ({ lines = [], error }) => {
        const now = performance.now() / 1000;
        setText(this.problems, error ?? "");
        for (const { message } of lines) this.frames.add(message, now, isStatic);
      };
    this.ends = [
      ["/tf", false],
      ["/tf_static", true],
    ].map(([topic, isStatic]) => this.link.subscribe({ topic, mode: "all" }, received(isStatic)));
  }

  forget() {
    for (const end of this.ends) end();
    this.ends = [];
    this.frames.clear();
    // A new subscription brings the latched transforms again.
    setTimeout(() => {
      if (!this.isClosed) this.subscribe();
    }, REFRESH_MS);
    this.draw();
  }

  draw() {
    const now = performance.now() / 1000;
    this.frames.remember(now);
    const names = this.frames.names();
    const signature = JSON.stringify(names.map((name) => [name, this.frames.frames.get(name)?.parent]));
    if (signature !== this.signature) {
      redraw(this.drawing, () => {
        this.signature = signature;
        this.lay(names);
      });
    }
    let bad = 0;
    for (const [name, box] of this.boxes) if (this.show(name, box, now)) bad += 1;
    const roots = this.frames.roots();
    setText(
      this.summary,
      names.length
        ? [
            t("{count} frames", { count: names.length }),
            roots.length === 1
              ? t("root {name}", { name: roots[0] })
              : t("{count} trees: {names}", {
                  count: roots.length,
                  names: `${roots.slice(0, 4).join(", ")}${roots.length > 4 ? ", …" : ""}`,
                }),
            ...(bad ? [t("{count} with a problem", { count: bad })] : []),
          ].join(", ")
        : "",
    );
    setText(
      this.empty,
      names.length || this.link.state !== "open"
        ? ""
        : t("Nothing has come on {topic}.", { topic: t("/tf or /tf_static") }),
    );
    this.showSide(now);
  }

  lay(names) {
    const graph = new Layered({ multigraph: false });
    graph.setGraph({ rankdir: "TB", nodesep: 24, ranksep: 34, marginx: 12, marginy: 12 });
    const measure = h("canvas").getContext("2d");
    measure.font = "600 14px system-ui, sans-serif";
    // The layout keeps its boxes in plain objects, where a frame may not be called "__proto__".
    for (const name of names)
      graph.setNode(`f${name}`, {
        width: Math.max(96, measure.measureText(brief(name)).width + 32),
        height: this.frames.frames.has(name) ? HEIGHT : 30,
      });
    for (const name of names) {
      const parent = this.frames.frames.get(name)?.parent;
      if (parent !== undefined) graph.setEdge(`f${parent}`, `f${name}`, {});
    }
    layout(graph);
    const edges = graph.edges().map((id) => {
      const edge = svg("g", { class: "edge" }, svg("path", { d: pathOf(graph.edge(id).points) }));
      edge.dataset.to = id.w.slice(1);
      return edge;
    });
    this.boxes = new Map(names.map((name) => [name, this.makeBox(name, graph.node(`f${name}`))]));
    this.drawing.replaceChildren(...edges, ...[...this.boxes.values()].map(({ element }) => element));
    this.panzoom.resized(graph.graph().width, graph.graph().height);
    this.highlight();
  }

  makeBox(name, { x, y, width, height }) {
    const choose = () => this.choose(name);
    const isRoot = !this.frames.frames.has(name);
    const text = svg("text", { x, y: y + 14, class: "measured" });
    const element = svg(
      "g",
      {
        class: `frame-box${isRoot ? " root" : ""}`,
        tabindex: 0,
        role: "button",
        "aria-label": t("frame {name}", { name }),
        onclick: choose,
        onkeydown: (event) => {
          if (event.key !== "Enter" && event.key !== " ") return;
          event.preventDefault(); // the page would scroll
          choose();
        },
      },
      svg("rect", { x: x - width / 2, y: y - height / 2, width, height, rx: 6 }),
      svg("title", {}, name),
      svg("text", { x, y: isRoot ? y + 5 : y - 3 }, brief(name)),
      isRoot ? null : text,
    );
    element.dataset.frame = name;
    return { element, text };
  }

  /** Show what is measured of a frame; return whether something is wrong with it. */
  show(name, { element, text }, now) {
    const frame = this.frames.frames.get(name);
    if (!frame) return false;
    const problem = this.frames.problem(name, now);
    setText(text, shownRate(frame, this.frames.measured(name, now)));
    element.classList.toggle("bad", Boolean(problem));
    element.classList.toggle("static", frame.isStatic);
    return Boolean(problem);
  }

  choose(name) {
    this.chosen = this.chosen === name ? null : name;
    this.place.remember({ frame: this.chosen });
    this.highlight();
    this.draw();
  }

  highlight() {
    const words = this.filter.value.toLowerCase();
    const line = new Set();
    for (
      let at = this.chosen;
      at !== undefined && at !== null && !line.has(at);
      at = this.frames.frames.get(at)?.parent
    )
      line.add(at);
    for (const [name, { element }] of this.boxes) {
      element.classList.toggle("selected", name === this.chosen);
      element.classList.toggle("near", words ? name.toLowerCase().includes(words) : line.has(name));
    }
    for (const part of this.drawing.querySelectorAll(".edge"))
      part.classList.toggle("near", !words && line.has(part.dataset.to));
    this.drawing.classList.toggle("dimmed", Boolean(words) || (this.chosen !== null && this.boxes.has(this.chosen)));
  }

  showSide(now) {
    const frame = this.frames.frames.get(this.chosen);
    this.side.hidden = !this.boxes.has(this.chosen);
    if (this.side.hidden) return;
    const rows = [];
    const add = (name, value) => rows.push(h("tr", {}, h("th", { scope: "row" }, t(name)), h("td", {}, value)));
    if (frame) {
      const { translation: p, rotation: q } = frame.transform;
      const { hz, age } = this.frames.measured(this.chosen, now);
      const angles = eulerOf(q);
      add("parent", frame.parent);
      add("published", frame.isStatic ? t("static") : hz === null ? t("measuring …") : `${hz.toFixed(1)} Hz`);
      if (age !== null) add("last one", t("{age} s ago", { age: age.toFixed(age < 10 ? 2 : 0) }));
      add("x, y, z", [p.x, p.y, p.z].map((each) => number(Number(each.toFixed(4)))).join(", "));
      add(
        "roll, pitch, yaw",
        `${angles.map((each) => number(Number(((each * 180) / Math.PI).toFixed(2)))).join(", ")} °`,
      );
      add("quaternion", [q.x, q.y, q.z, q.w].map((each) => number(Number(each.toFixed(4)))).join(", "));
      const topic = frame.isStatic ? "/tf_static" : "/tf";
      add(t("on {topic}", { topic }), (this.link.graph.published.get(topic) ?? []).join(", "));
    }
    const children = [...this.frames.frames.values()]
      .filter(({ parent }) => parent === this.chosen)
      .map(({ child }) => child)
      .sort();
    if (children.length) add("children", children.join(", "));
    const problem = this.frames.problem(this.chosen, now);
    refill(
      this.side,
      h("h2", {}, this.chosen),
      problem ? h("p", { class: "error" }, problem) : null,
      frame ? null : h("p", { class: "muted" }, t("The root of its tree: nobody publishes its parent.")),
      h("table", { class: "values facts" }, h("tbody", {}, rows)),
    );
  }
}

function shownRate(frame, { hz, age }) {
  if (frame.isStatic) return t("static");
  const old = age < 1 ? "" : ` · ${t("{age} s ago", { age: age.toFixed(age < 10 ? 1 : 0) })}`;
  return hz === null ? `…${old}` : `${hz.toFixed(1)} Hz${old}`;
}
