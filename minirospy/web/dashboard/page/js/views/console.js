// The log lines of all nodes (/rosout_agg): filters, search, pause, copy, export, and the levels of loggers.

import { download, fill, h, setText } from "../dom.js";
import { LEVELS, NAMES, csv, filterOf, lineOf, linesOf, plainText, timeText } from "../logs.js";
import { VirtualList } from "../virtual_list.js";
import { t } from "../texts.js";

const MAX_LINES = 50_000;
const MAX_BYTES = 100_000_000; // of a log file

// The lines outlive the view: they are collected from the first visit on.
const lines = [];
const counts = new Map(LEVELS.map(([level]) => [level, 0]));
let end = null;
const listeners = new Set(); // of the views that are open: a layout may have several
let removed = 0;

/** Collect the lines from now on; call a function with all of them after each change, and return what ends that. */
export function collect(link, received = null) {
  end ??= link.subscribe({ topic: "/rosout_agg", mode: "all" }, (item) => {
    append((item.lines ?? []).map(lineOf));
  });
  if (!received) return () => {};
  const listener = () => received(lines);
  listeners.add(listener);
  listener();
  return () => listeners.delete(listener);
}

function append(added) {
  for (const line of added) {
    line.number = removed + lines.length;
    lines.push(line);
    counts.set(line.level, (counts.get(line.level) ?? 0) + 1);
  }
  let cut = 0;
  if (lines.length > MAX_LINES) {
    cut = lines.length - MAX_LINES + MAX_LINES / 10;
    lines.splice(0, cut);
    removed += cut;
  }
  for (const listener of listeners) listener(cut);
}

const MAX_IN_ROW = 1000; // characters

export class Console {
  constructor(link, words, main, place) {
    this.link = link;
    this.place = place;
    const given = words.get("levels")?.split(",").map(Number);
    this.levels = new Set(LEVELS.map(([level]) => level).filter((level) => !given || given.includes(level)));
    this.isPaused = false;
    this.shown = []; // the lines that pass the filter
    this.seen = removed; // how many lines, of all that ever came, have been filtered
    this.selected = null;
    this.nodes = new Set();

    this.buttons = new Map(
      LEVELS.map(([level, name]) => [
        level,
        h(
          "button",
          {
            type: "button",
            class: `level l${level}`,
            "aria-pressed": String(this.levels.has(level)),
            onclick: () => this.switchLevel(level),
          },
          h("span", {}, t(name)),
          " ",
          h("span", { class: "count" }, "0"),
        ),
      ]),
    );
    this.node = h(
      "select",
      { "aria-label": "Node", onchange: () => this.change() },
      h("option", { value: "" }, "all nodes"),
    );
    this.text = h("input", {
      type: "search",
      placeholder: "Search messages and nodes",
      "aria-label": "Search",
      value: words.get("text") ?? "",
      oninput: () => this.change(),
    });
    this.isRegex = h("input", { type: "checkbox", checked: words.get("regex") === "1", onchange: () => this.change() });
    this.isExcluded = h("input", {
      type: "checkbox",
      checked: words.get("exclude") === "1",
      onchange: () => this.change(),
    });
    this.isMarked = h("input", { type: "checkbox", checked: words.get("mark") === "1", onchange: () => this.change() });
    this.file = h("input", {
      type: "file",
      accept: ".log,.txt",
      hidden: true,
      "aria-label": "Log file",
      onchange: () => this.open(this.file),
    });
    this.pauseButton = h("button", { type: "button", "aria-pressed": "false", onclick: () => this.pause() }, "Pause");
    this.latest = h(
      "button",
      {
        type: "button",
        hidden: true,
        class: "primary",
        onclick: () => {
          this.list.follow();
          this.showCount();
        },
      },
      "↓ Latest",
    );
    this.loggersButton = h("button", { type: "button", onclick: () => this.toggleLoggers() }, "Logger levels");
    this.count = h("span", { class: "muted" });
    this.problem = h("span", { class: "error" });
    this.list = new VirtualList(
      () => this.makeRow(),
      (row, index) => this.showRow(row, this.shown[index]),
    );
    this.list.element.addEventListener("scroll", () => this.showCount());
    this.list.element.setAttribute("aria-label", t("Log lines"));
    this.details = h("div", { class: "panel details", hidden: true });
    this.loggers = h("div", { class: "panel details loggers", hidden: true });
    main.append(
      h(
        "div",
        { class: "bar console-bar" },
        [...this.buttons.values()],
        this.node,
        this.text,
        h("label", {}, this.isRegex, t("regex")),
        h("label", {}, this.isExcluded, t("exclude")),
        h("label", { title: "Show all lines, and mark those that fit" }, this.isMarked, t("highlight")),
        this.problem,
      ),
      h(
        "div",
        { class: "bar console-bar" },
        this.pauseButton,
        h("button", { type: "button", onclick: () => this.clear() }, "Clear"),
        h("button", { type: "button", onclick: (event) => this.copy(event.currentTarget) }, "Copy"),
        h("button", { type: "button", onclick: () => this.save() }, "Export CSV"),
        h(
          "button",
          { type: "button", title: "rosout.log, or a node's log of ~/.ros/log", onclick: () => this.file.click() },
          "Open log",
        ),
        this.file,
        this.loggersButton,
        this.count,
        this.latest,
      ),
      this.loggers,
      h("div", { class: "panel lines" }, this.list.element),
      this.details,
    );

    this.listener = (cut) => this.arrived(cut);
    listeners.add(this.listener);
    if (words.get("node")) {
      this.addNode(words.get("node"));
      this.node.value = words.get("node");
    }
    collect(link);
    this.filter();
  }

  close() {
    listeners.delete(this.listener);
    this.list.close();
  }

  arrived(cut) {
    if (cut === Infinity) {
      this.selected = null;
      this.details.hidden = true;
      this.filter();
      return;
    }
    if (this.isPaused) {
      this.showCount();
      return;
    }
    if (cut) {
      const before = this.shown.length;
      // By number: stamps of nodes differ, and simulated time may start again.
      const index = this.shown.findIndex((each) => each.number >= removed);
      this.shown.splice(0, index < 0 ? before : index);
      this.list.removed(before - this.shown.length);
    }
    this.filterNew();
  }

  /** Filter as a person has set it, and keep that in the address. */
  change() {
    this.filter();
    const isAll = this.levels.size === LEVELS.length;
    this.place.remember({
      text: this.text.value,
      node: this.node.value,
      levels: isAll ? "" : [...this.levels].join(",") || "0",
      regex: this.isRegex.checked,
      exclude: this.isExcluded.checked,
      mark: this.isMarked.checked,
    });
  }

  filter() {
    const { checked: isMarked } = this.isMarked;
    try {
      const filter = {
        levels: this.levels,
        node: this.node.value,
        text: this.text.value,
        isRegex: this.isRegex.checked,
        isExcluded: this.isExcluded.checked,
      };
      const passes = filterOf(filter);
      this.marks = isMarked && filter.text ? passes : null;
      this.passes = isMarked ? filterOf({ ...filter, text: "" }) : passes;
      setText(this.problem, "");
    } catch (error) {
      setText(this.problem, error.message);
      return;
    }
    this.shown = [];
    this.seen = removed;
    this.filterNew();
  }

  filterNew() {
    for (let index = Math.max(0, this.seen - removed); index < lines.length; index++) {
      const line = lines[index];
      this.addNode(line.node);
      if (this.passes(line)) this.shown.push(line);
    }
    this.seen = removed + lines.length;
    this.list.update(this.shown.length);
    this.showCount();
  }

  addNode(name) {
    if (this.nodes.has(name)) return;
    this.nodes.add(name);
    const after = [...this.node.options].find((option) => option.value > name) ?? null;
    this.node.insertBefore(h("option", { value: name }, name), after);
  }

  showCount() {
    for (const [level, button] of this.buttons) setText(button.querySelector(".count"), String(counts.get(level)));
    const waiting = this.isPaused ? removed + lines.length - this.seen : 0;
    setText(
      this.count,
      t("{count} of {all} lines", { count: this.shown.length, all: lines.length }) +
        (this.isPaused ? t(", paused, {waiting} new", { waiting }) : ""),
    );
    this.latest.hidden = this.list.isFollowing;
  }

  makeRow() {
    const row = h(
      "div",
      { class: "line", onclick: () => this.select(row.line) },
      h("span", { class: "time" }),
      h("span", { class: "word" }),
      h("span", { class: "node" }),
      h("span", { class: "text" }),
    );
    return row;
  }

  showRow(row, line) {
    row.classList.toggle("selected", line === this.selected);
    row.classList.toggle("marked", Boolean(this.marks?.(line)));
    if (row.line === line) return;
    row.line = line;
    row.dataset.level = line.level;
    const [time, word, node, text] = row.children;
    setText(time, timeText(line.stamp));
    setText(word, t(NAMES.get(line.level) ?? String(line.level)));
    setText(node, oneLine(line.node));
    setText(text, oneLine(line.text));
  }

  select(line) {
    this.selected = this.selected === line ? null : line;
    this.details.hidden = !this.selected;
    if (this.selected) {
      fill(
        this.details,
        h(
          "div",
          { class: "bar" },
          h("strong", {}, `${t(NAMES.get(line.level) ?? String(line.level))} · ${line.node}`),
          h("span", { class: "muted" }, `${timeText(line.stamp)} · ${line.file}:${line.line} ${line.function}`),
          h(
            "button",
            {
              type: "button",
              onclick: () => {
                this.node.value = line.node;
                this.change();
              },
            },
            "Only this node",
          ),
        ),
        h("pre", {}, line.text),
      );
    }
    this.list.draw();
  }

  switchLevel(level) {
    if (!this.levels.delete(level)) this.levels.add(level);
    this.buttons.get(level).setAttribute("aria-pressed", String(this.levels.has(level)));
    this.change();
  }

  pause() {
    this.isPaused = !this.isPaused;
    this.pauseButton.setAttribute("aria-pressed", String(this.isPaused));
    setText(this.pauseButton, this.isPaused ? t("Continue") : t("Pause"));
    if (!this.isPaused) this.filter();
    this.showCount();
  }

  clear() {
    removed += lines.length;
    lines.length = 0;
    for (const level of counts.keys()) counts.set(level, 0);
    for (const listener of listeners) listener(Infinity);
  }

  /** Put the lines of a log file behind those that are there. */
  async open({ files: [file] }) {
    if (!file) return;
    this.file.value = "";
    if (file.size > MAX_BYTES) {
      setText(this.problem, t("{name} is larger than {size} MB", { name: file.name, size: MAX_BYTES / 1e6 }));
      return;
    }
    const found = linesOf(await file.text(), file.name);
    append(found.slice(-MAX_LINES));
    setText(this.problem, found.length ? "" : t("{name} has no lines", { name: file.name }));
  }

  async copy(button) {
    const chosen = this.selected ? [this.selected] : this.shown;
    const text = chosen.map(plainText).join("\n");
    try {
      await navigator.clipboard.writeText(text);
      setText(button, t("Copied {count}", { count: chosen.length }));
    } catch {
      // Without https a browser allows it on localhost only.
      setText(button, t("The browser refuses"));
    }
    setTimeout(() => setText(button, t("Copy")), 1500);
  }

  save() {
    download("console.csv", new Blob([csv(this.shown)], { type: "text/csv" }));
  }

  toggleLoggers() {
    this.loggers.hidden = !this.loggers.hidden;
    this.loggersButton.setAttribute("aria-pressed", String(!this.loggers.hidden));
    if (!this.loggers.hidden) this.showLoggers();
  }

  showLoggers() {
    const nodes = [...this.link.services.keys()]
      .filter((name) => name.endsWith("/get_loggers"))
      .map((name) => name.slice(0, -"/get_loggers".length));
    const list = h("div", { class: "grid" });
    const choice = h(
      "select",
      { "aria-label": "Node of the loggers", onchange: () => this.showLoggersOf(choice.value, list) },
      h("option", { value: "" }, "choose a node"),
      nodes.map((name) => h("option", { value: name }, name)),
    );
    fill(
      this.loggers,
      h(
        "div",
        { class: "bar" },
        h("strong", {}, "Logger levels"),
        choice,
        h(
          "span",
          { class: "muted" },
          this.link.mayWrite ? t("what a node logs, from this level on") : t("This token is read-only."),
        ),
      ),
      list,
    );
  }

  async showLoggersOf(node, list) {
    fill(list);
    if (!node) return;
    try {
      const { loggers } = await this.link.call(`${node}/get_loggers`, {});
      for (const logger of loggers) {
        const choice = h(
          "select",
          { "aria-label": logger.name, onchange: () => this.setLevel(node, logger.name, choice, list) },
          LEVELS.map(([, name]) => h("option", { value: name.toLowerCase() }, name)),
        );
        choice.value = logger.level.toLowerCase();
        list.append(h("span", {}, logger.name), choice);
      }
    } catch (error) {
      fill(list, h("span", { class: "error" }, error.message));
    }
  }

  async setLevel(node, logger, choice, list) {
    try {
      await this.link.call(`${node}/set_logger_level`, { logger, level: choice.value });
    } catch (error) {
      fill(list, h("span", { class: "error" }, error.message));
    }
  }
}

/** Return a text that stays in its row: all of it is below after a click. */
function oneLine(text) {
  return text
    .slice(0, MAX_IN_ROW)
    .replace(/[\r\n\v\f\u0085\u2028\u2029]+/g, (breaks, at) =>
      at + breaks.length < Math.min(text.length, MAX_IN_ROW) ? " ↵ " : "",
    );
}
