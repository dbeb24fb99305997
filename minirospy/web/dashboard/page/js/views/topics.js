// All topics: type, rate, bandwidth, and the live values of those that are open.

import { bandwidth, fill, h, setText, shown } from "../dom.js";
import { Folders } from "../folders.js";
import { anglesOf, namedSteps, numberOf } from "../paths.js";
import { Rate } from "../rates.js";
import { isList } from "../ros1.js";
import { t } from "../texts.js";

// Measuring these costs the bandwidth of a camera: only when opened.
const HEAVY = new Set([
  "sensor_msgs/Image",
  "sensor_msgs/CompressedImage",
  "sensor_msgs/PointCloud2",
  "sensor_msgs/PointCloud",
  "nav_msgs/OccupancyGrid",
  "theora_image_transport/Packet",
  "stereo_msgs/DisparityImage",
]);
const MAX_ITEMS = 100; // of one array that is opened
const REFRESH_MS = 500;

export class Topics {
  constructor(link, words, main, place) {
    this.link = link;
    this.place = place;
    this.rows = new Map();
    this.opened = new Set(words.getAll("open"));
    this.linked = words.get("open");
    this.filter = h("input", {
      type: "search",
      placeholder: "Filter topics and types",
      "aria-label": "Filter",
      value: words.get("filter") ?? "",
      oninput: () => {
        this.showFiltered();
        this.remember();
      },
    });
    this.count = h("span", { class: "muted" });
    this.list = h("div", { class: "topics", role: "tree", "aria-label": "Topics" });
    this.empty = h("p", { class: "empty" });
    this.folders = new Folders(this.list, {
      rowOf: (topic) => this.rows.get(topic).element,
      show: (element, label, depth) => this.rows.get(element.dataset.topic).place(label, depth),
      wrap: (button) => h("div", { class: "row folder-row", role: "treeitem" }, button),
      changed: () => this.showFiltered(),
    });
    main.append(h("div", { class: "bar" }, this.filter, this.count), this.list, this.empty);
    this.ending = link.watch(["channels", "state"], () => this.update());
    this.timer = setInterval(() => this.refresh(), REFRESH_MS);
  }

  close() {
    this.ending();
    clearInterval(this.timer);
    for (const row of this.rows.values()) row.close();
  }

  update() {
    const { channels } = this.link;
    for (const [topic, row] of this.rows) {
      if (channels.get(topic)?.schema !== row.channel.schema) {
        // While the connection is lost the rows stay, with their last values.
        if (this.link.state !== "open" && !channels.size) continue;
        row.close();
        row.element.remove();
        this.rows.delete(topic);
      }
    }
    for (const [topic, channel] of channels) {
      if (this.rows.has(topic)) continue;
      const row = new Row(this.link, channel, this.opened.has(topic), (isOpen) => this.toggled(topic, isOpen));
      this.rows.set(topic, row);
    }
    this.showFiltered();
    this.showLinked();
  }

  /** Scroll to the topic of the link, once it is there. */
  showLinked() {
    const row = this.rows.get(this.linked);
    if (!row) return;
    this.linked = null;
    row.element.scrollIntoView({ block: "nearest" });
  }

  toggled(topic, isOpen) {
    if (isOpen) this.opened.add(topic);
    else this.opened.delete(topic);
    this.remember();
  }

  remember() {
    this.place.remember({ filter: this.filter.value, open: [...this.opened] });
  }

  /** Open what another view links to. */
  accept(words) {
    for (const topic of words.getAll("open")) {
      const row = this.rows.get(topic);
      if (row && !row.isOpen) {
        row.toggle();
        this.showFiltered();
      }
      row?.element.scrollIntoView({ block: "nearest" });
    }
    return true;
  }

  showFiltered() {
    const words = this.filter.value.toLowerCase().split(/\s+/);
    const found = [...this.rows.values()]
      .filter(({ channel }) => {
        const text = `${channel.topic} ${channel.type}`.toLowerCase();
        return words.every((word) => text.includes(word));
      })
      .map(({ channel }) => channel.topic)
      .sort(byName);
    const shown = new Set(found);
    const folded = this.folders.arrange(found, { needed: this.opened, isFiltered: Boolean(this.filter.value) });
    for (const [topic, row] of this.rows) row.setShown(shown.has(topic) && !folded.has(topic), folded.has(topic));
    const count = found.length;
    setText(this.count, t("{count} of {all} topics", { count, all: this.rows.size }));
    setText(
      this.empty,
      this.rows.size
        ? count
          ? ""
          : t("No topic fits the filter.")
        : this.link.state === "open"
          ? t("Nothing is published yet. Start a node: its topics appear here.")
          : "",
    );
  }

  refresh() {
    for (const row of this.rows.values()) row.refresh();
  }
}

const byName = (one, other) => (one < other ? -1 : 1);

class Row {
  constructor(link, channel, isOpen, toggled) {
    this.link = link;
    this.channel = channel;
    this.rate = new Rate();
    this.end = null;
    this.isOpen = false;
    this.message = null;
    this.hz = h("span", { class: "num" });
    this.bandwidth = h("span", { class: "num wide" });
    this.preview = h("span", { class: "preview" });
    this.fields = h("div", { class: "fields", role: "group", hidden: true });
    this.button = h(
      "button",
      { type: "button", class: "topic", "aria-expanded": "false", onclick: () => this.toggle() },
      (this.name = h("span", { class: "name" }, channel.topic)),
      h("span", { class: "type" }, channel.type),
      this.hz,
      this.bandwidth,
      this.preview,
    );
    this.element = h("div", { class: "row", role: "treeitem" }, this.button, this.fields);
    this.element.dataset.topic = channel.topic;
    this.tree = null;
    this.toggled = () => {};
    if (isOpen) this.toggle();
    this.toggled = toggled;
  }

  /** Show the part of the name that is not in the folders around the row. */
  place(label, depth) {
    setText(this.name, label);
    this.name.title = this.channel.topic;
    this.element.style.setProperty("--depth", String(depth));
  }

  /** Show or hide the row. A topic in a folder that is folded is not subscribed to. */
  setShown(isShown, isFolded) {
    this.element.hidden = !isShown;
    if (isShown && !this.end && !HEAVY.has(this.channel.type)) this.subscribe();
    else if (isFolded && !this.isOpen && this.end) {
      this.close();
      this.rate = new Rate();
    }
  }

  subscribe() {
    this.end?.();
    this.end = this.link.subscribe(
      { topic: this.channel.topic, mode: "latest", isCounted: HEAVY.has(this.channel.type) && !this.isOpen },
      (item) => this.received(item),
    );
  }

  toggle() {
    this.isOpen = !this.isOpen;
    this.button.setAttribute("aria-expanded", String(this.isOpen));
    this.fields.hidden = !this.isOpen;
    if (!this.end || HEAVY.has(this.channel.type)) this.subscribe();
    this.show();
    this.toggled(this.isOpen);
  }

  close() {
    this.end?.();
    this.end = null;
  }

  received(item) {
    this.rate.add(performance.now() / 1000, item.count ?? 0, item.bytes ?? 0);
    this.error = item.error ?? null;
    if (item.message) this.message = item.message;
    this.isStale = true;
    if (this.isOpen) this.show();
  }

  refresh() {
    const rate = this.rate.at(performance.now() / 1000);
    setText(
      this.hz,
      rate
        ? `${rate.hz < 10 ? rate.hz.toFixed(2) : rate.hz.toFixed(1)} Hz`
        : HEAVY.has(this.channel.type) && !this.end
          ? t("open to measure")
          : "–",
    );
    setText(this.bandwidth, rate ? bandwidth(rate.bytes) : "");
    if (this.isStale && !this.isOpen) setText(this.preview, this.error ?? oneLine(this.message));
    if (this.isOpen) setText(this.preview, "");
    this.isStale = false;
  }

  show() {
    if (!this.isOpen) return;
    if (this.error) {
      fill(this.fields, h("p", { class: "error" }, this.error));
      this.tree = null;
    } else if (!this.message) {
      fill(this.fields, h("p", { class: "muted" }, "Waiting for a message …"));
      this.tree = null;
    } else {
      if (!this.tree) {
        this.tree = new Tree(this.channel.topic);
        fill(this.fields, this.tree.element);
      }
      this.tree.show(this.message);
    }
  }
}

function oneLine(message) {
  if (!message) return "";
  const entries = Object.entries(message).filter(([name]) => name !== "header");
  return entries.length === 1 ? `${entries[0][0]}: ${shown(entries[0][1])}` : shown(Object.fromEntries(entries));
}

// The fields of a message; elements are kept from one message to the next, so a person can select and click them.
export class Tree {
  constructor(path) {
    this.path = path;
    this.element = h("ul", {});
    this.items = new Map();
  }

  /** ``steps``: of an array, the steps to its elements by names, as of joints; null: by index. */
  show(message, steps = null) {
    const isArray = isList(message);
    /** @type {(string | number)[]} */
    const names = isArray
      ? Array.from({ length: Math.min(message.length, MAX_ITEMS) }, (_, index) => index)
      : Object.keys(message);
    const wanted = new Set(names);
    for (const [name, item] of this.items) {
      if (!wanted.has(name)) {
        item.element.remove();
        this.items.delete(name);
      }
    }
    for (const name of names) {
      const step = isArray ? (steps?.[name] ?? `[${name}]`) : `/${name}`;
      let item = this.items.get(name);
      if (item?.path !== this.path + step) {
        // The names came later, or changed.
        const before = item?.element;
        item = new Field(isArray ? step : String(name), this.path + step);
        this.items.set(name, item);
        if (before) before.replaceWith(item.element);
        else this.element.append(item.element);
      }
      const value = message[name];
      item.show(value, !isArray && isList(value) && name !== "name" ? namedSteps(message.name, value) : null);
    }
  }
}

class Field {
  constructor(label, path) {
    this.path = path;
    this.value = h("span", { class: "value" });
    this.plot = h(
      "a",
      {
        class: "plot",
        href: `#/plot?path=${encodeURIComponent(path)}`,
        title: t("Plot {path}", { path }),
        hidden: true,
      },
      t("plot"),
    );
    this.head = h(
      "button",
      { type: "button", class: "field", disabled: true, onclick: () => this.toggle() },
      h("span", { class: "key" }, label),
    );
    this.element = h("li", { ondragstart: (event) => this.drag(event) }, this.head, this.value, this.plot);
    this.tree = null;
    this.isOpen = null;
  }

  show(value, steps = null) {
    this.last = value;
    this.steps = steps;
    const isNested = value !== null && typeof value === "object" && numberOf(value) === null;
    if (!isNested) {
      setText(this.value, shown(numberOf(value) !== null && typeof value === "object" ? numberOf(value) : value, 2000));
      this.plot.hidden = numberOf(value) === null;
      this.element.draggable = !this.plot.hidden;
      return;
    }
    const angles = isList(value) ? [] : anglesOf(value);
    this.plot.hidden = !angles.length;
    if (angles.length) {
      this.plot.href = `#/plot?${new URLSearchParams(angles.map((angle) => ["path", `${this.path}/${angle}`]))}`;
      setText(this.plot, t("plot the angles"));
    }
    // Messages start open, arrays closed.
    this.isOpen ??= !isList(value);
    this.head.disabled = false;
    this.head.setAttribute("aria-expanded", String(this.isOpen));
    setText(
      this.value,
      this.isOpen
        ? !isList(value)
          ? ""
          : t("{count} values", { count: value.length }) +
            (value.length > MAX_ITEMS ? t(", the first {count} are shown", { count: MAX_ITEMS }) : "")
        : shown(value),
    );
    if (this.isOpen) {
      if (!this.tree) {
        this.tree = new Tree(this.path);
        this.element.append(this.tree.element);
      }
      this.tree.show(value, steps);
    }
    if (this.tree) this.tree.element.hidden = !this.isOpen;
  }

  /** Let a plot have the field: of another pane, or another window. */
  drag(event) {
    event.stopPropagation();
    event.dataTransfer.setData("text/plain", this.path);
  }

  toggle() {
    this.isOpen = !this.isOpen;
    this.show(this.last, this.steps);
  }
}
