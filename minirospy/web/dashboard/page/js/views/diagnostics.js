// Diagnostics: the tree of /diagnostics_agg, or what /diagnostics has while nobody aggregates; levels in color, values
// on a click.

import { fill, h, refill, setText } from "../dom.js";
import { timeText } from "../logs.js";
import { t } from "../texts.js";

const TYPE = "diagnostic_msgs/DiagnosticArray";
const AGGREGATED = "/diagnostics_agg";
const USUAL = "/diagnostics";
const LEVELS = ["OK", "Warning", "Error", "Stale"];
const STALE_SECONDS = 5; // without a message, as in rqt_runtime_monitor
const MOST = 5000; // statuses that are kept
const MAX_CHANGES = 30; // of one status

export class Diagnostics {
  constructor(link, words, main, place) {
    this.link = link;
    this.place = place;
    this.topic = words.get("topic") ?? "";
    this.chosen = words.get("name");
    this.statuses = new Map(); // path -> {path, name, level, message, hardware, values, at, changes}
    this.rows = new Map(); // path -> row
    this.folded = new Set();
    this.end = null;
    this.choice = h("select", { "aria-label": "Topic", onchange: () => this.choose(this.choice.value) });
    this.counts = LEVELS.map((name, level) =>
      h("span", { class: `badge d${level}` }, t(name), " ", h("span", { class: "count" }, "0")),
    );
    this.isBad = h("input", {
      type: "checkbox",
      checked: words.get("problems") === "1",
      onchange: () => {
        this.remember();
        this.draw();
      },
    });
    this.tree = h("div", { class: "panel tree", role: "tree", "aria-label": "Diagnostics" });
    this.empty = h("p", { class: "empty" });
    this.side = h("div", { class: "panel side details", hidden: true });
    this.problem = h("p", { class: "error" });
    main.append(
      h("div", { class: "bar" }, this.choice, this.counts, h("label", {}, this.isBad, "only problems")),
      this.problem,
      h("div", { class: "split" }, h("div", { class: "diagnostics" }, this.tree, this.empty), this.side),
    );
    this.ending = link.watch(["channels", "state"], () => this.update());
    this.timer = setInterval(() => this.draw(), 1000);
  }

  close() {
    clearInterval(this.timer);
    this.ending();
    this.end?.();
  }

  update() {
    const topics = [...this.link.channels.values()].filter(({ type }) => type === TYPE).map(({ topic }) => topic);
    const known = [...new Set([AGGREGATED, USUAL, ...topics, ...(this.topic ? [this.topic] : [])])];
    if (known.join(" ") !== this.known) {
      this.known = known.join(" ");
      fill(
        this.choice,
        h("option", { value: "" }, "the aggregated ones, else all"),
        known.map((topic) => h("option", { value: topic }, topic)),
      );
    }
    this.choice.value = this.topic;
    const wanted = this.topic || (topics.includes(AGGREGATED) ? AGGREGATED : USUAL);
    if (wanted !== this.subscribed) this.subscribe(wanted);
    this.draw();
  }

  choose(topic) {
    this.topic = topic;
    this.remember();
    this.update();
  }

  remember() {
    this.place.remember({ topic: this.topic, name: this.chosen, problems: this.isBad.checked });
  }

  subscribe(topic) {
    this.end?.();
    this.subscribed = topic;
    this.statuses.clear();
    this.end = this.link.subscribe({ topic, mode: "all" }, (item) => this.received(item));
  }

  received({ lines = [], error }) {
    setText(this.problem, error ?? "");
    const at = performance.now() / 1000;
    for (const { message } of lines) {
      for (const { name, level, message: text, hardware_id: hardware, values } of message.status) {
        const path = `/${name.split("/").filter(Boolean).join("/")}`;
        if (this.statuses.size >= MOST && !this.statuses.has(path)) continue;
        const before = this.statuses.get(path);
        const isSame = before?.level === level && before.message === text && !before.isSilent;
        const changes = isSame
          ? before.changes
          : [{ time: Date.now() / 1000, level, message: text }, ...(before?.changes ?? [])].slice(0, MAX_CHANGES);
        this.statuses.set(path, { path, name, level, message: text, hardware, values, at, changes });
      }
    }
    this.draw();
  }

  /** Return the level of a status; one whose messages have ended is stale. */
  levelOf(status, now) {
    const level = Math.min(3, Math.max(0, status.level));
    return now - status.at > STALE_SECONDS ? 3 : level;
  }

  /** Record that the messages of a status have ended. */
  silence(status) {
    status.isSilent = true;
    status.changes = [
      { time: Date.now() / 1000, level: 3, message: t("no message for {seconds} seconds", { seconds: STALE_SECONDS }) },
      ...status.changes,
    ].slice(0, MAX_CHANGES);
  }

  /** Return the nodes of the tree in order, each with its worst level; parents that nobody reports are added. */
  nodes(now) {
    const nodes = new Map();
    const isTree = this.subscribed !== USUAL;
    for (const path of [...this.statuses.keys()].sort()) {
      const status = this.statuses.get(path);
      // Names on /diagnostics are "node: what": slashes there are those of node names.
      const parts = isTree ? path.slice(1).split("/") : [status.name];
      parts.forEach((part, depth) => {
        const key = isTree ? `/${parts.slice(0, depth + 1).join("/")}` : path;
        if (!nodes.has(key))
          nodes.set(key, { path: key, label: part, depth, level: -1, status: null, hasChildren: false });
        const node = nodes.get(key);
        if (depth < parts.length - 1) node.hasChildren = true;
        else node.status = status;
      });
    }
    const ordered = [...nodes.values()].sort((one, other) => comparison(one.path.split("/"), other.path.split("/")));
    for (const { status } of ordered)
      if (status && !status.isSilent && now - status.at > STALE_SECONDS) this.silence(status);
    for (const node of ordered) if (node.status) node.level = this.levelOf(node.status, now);
    // From the leaves up: a parent without a status has the worst of its children.
    for (const node of [...ordered].reverse()) {
      const parent = isTree ? nodes.get(node.path.slice(0, node.path.lastIndexOf("/"))) : undefined;
      if (parent && !parent.status) parent.level = Math.max(parent.level, node.level);
    }
    return ordered;
  }

  draw() {
    const now = performance.now() / 1000;
    const nodes = this.nodes(now);
    const counts = [0, 0, 0, 0];
    for (const { status, level, hasChildren } of nodes) if (status && !hasChildren) counts[level] += 1;
    this.counts.forEach((badge, level) => setText(badge.querySelector(".count"), String(counts[level])));
    const isHidden = ({ path, level }) =>
      (this.isBad.checked && level < 1) || [...this.folded].some((each) => path.startsWith(`${each}/`));
    const shown = nodes.filter((node) => !isHidden(node));
    const seen = new Set(shown.map(({ path }) => path));
    for (const [path, row] of [...this.rows]) {
      if (seen.has(path)) continue;
      row.remove();
      this.rows.delete(path);
    }
    let after = null;
    for (const node of shown) {
      const row = this.rows.get(node.path) ?? this.makeRow(node.path);
      this.show(row, node);
      const place = after ? after.nextSibling : this.tree.firstChild;
      if (row !== place) this.tree.insertBefore(row, place);
      after = row;
    }
    this.tree.hidden = !shown.length;
    setText(
      this.empty,
      shown.length || this.link.state !== "open"
        ? ""
        : nodes.length
          ? t("Nothing reports a problem.")
          : t("Nothing has come on {topic}.", { topic: this.subscribed }),
    );
    this.showChosen(nodes);
  }

  makeRow(path) {
    const fold = h("button", {
      type: "button",
      class: "fold",
      "aria-label": "Fold",
      onclick: () => {
        if (!this.folded.delete(path)) this.folded.add(path);
        this.draw();
      },
    });
    const row = h(
      "div",
      { class: "status-row", role: "treeitem" },
      fold,
      h(
        "button",
        { type: "button", class: "report", onclick: () => this.select(path) },
        h("span", { class: "badge" }),
        h("span", { class: "name" }),
        h("span", { class: "muted text" }),
      ),
    );
    row.dataset.path = path;
    this.rows.set(path, row);
    return row;
  }

  show(row, { path, label, depth, level, status, hasChildren }) {
    const [fold, button] = row.children;
    const [badge, name, text] = button.children;
    row.style.paddingLeft = `${depth * 1.2}rem`;
    row.setAttribute("aria-level", depth + 1);
    row.classList.toggle("selected", path === this.chosen);
    fold.classList.toggle("leaf", !hasChildren);
    fold.setAttribute("aria-expanded", String(!this.folded.has(path)));
    badge.className = `badge d${level}`;
    setText(badge, t(LEVELS[level]));
    setText(name, label);
    setText(text, status?.message ?? "");
  }

  select(path) {
    this.chosen = this.chosen === path ? null : path;
    this.remember();
    this.draw();
  }

  showChosen(nodes) {
    const node = nodes.find(({ path }) => path === this.chosen);
    this.side.hidden = !node;
    if (!node) return;
    const { status, level } = node;
    const content = JSON.stringify([
      node.path,
      level,
      status?.message,
      status?.hardware,
      status?.values,
      status?.changes,
    ]);
    if (content === this.shown) return;
    this.shown = content;
    refill(
      this.side,
      h("h2", {}, status?.name ?? node.path),
      h("p", {}, h("span", { class: `badge d${level}` }, t(LEVELS[level])), " ", status?.message ?? ""),
      status?.hardware ? h("p", { class: "muted" }, t("hardware: "), status.hardware) : null,
      h(
        "table",
        { class: "values" },
        h(
          "tbody",
          {},
          (status?.values ?? []).map(({ key, value }) =>
            h("tr", {}, h("th", { scope: "row" }, key), h("td", {}, value)),
          ),
        ),
      ),
      // What it was before, the newest first.
      status?.changes.length > 1
        ? [
            h("h3", {}, "History"),
            h(
              "ul",
              { class: "history" },
              status.changes.map((each) =>
                h(
                  "li",
                  {},
                  h("span", { class: "mono muted" }, timeText(each.time)),
                  " ",
                  h("span", { class: `badge d${Math.min(3, each.level)}` }, t(LEVELS[Math.min(3, each.level)])),
                  " ",
                  each.message,
                ),
              ),
            ),
          ]
        : null,
    );
  }
}

function comparison(one, other) {
  for (let index = 0; index < Math.min(one.length, other.length); index++) {
    if (one[index] !== other[index]) return one[index] < other[index] ? -1 : 1;
  }
  return one.length - other.length;
}
