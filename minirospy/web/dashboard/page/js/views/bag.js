// Bags: topics recorded into the folder of the command, and a bag on a timeline, played without or with publishing it.

import { decompressed } from "../compressed.js";
import { bandwidth, fill, h, setText } from "../dom.js";
import { Endpoint } from "../endpoint.js";
import { pixelsOf } from "../pixels.js";
import { Rate } from "../rates.js";
import { decode } from "../ros1.js";
import { language, t, errorText } from "../texts.js";
import { Axis, clockText, heights, sizeText } from "../timeline.js";
import { Tree } from "./topics.js";

const PROTOCOL = "minirospy.bag.v1";
const IMAGES = new Set(["sensor_msgs/Image", "sensor_msgs/CompressedImage"]);
const HEAVY = new Set([...IMAGES, "sensor_msgs/PointCloud2", "sensor_msgs/PointCloud"]); // measured when chosen
const RULER = 26;
const ROW = 30;
const IMAGE_ROW = 64;
const APART = 83; // pixels from one thumbnail to the next, before their width is known
const WIDEST = 160;
const HEAD_BYTES = 11;
const MOMENT = 1;
const MAX_SHOWN_FIRST = 3;
const COMPRESSIONS = [
  [".bag", "none"],
  [".bag", "lz4"],
  [".bag", "bz2"],
  [".mcap", "none"],
  [".mcap", "lz4"],
  [".mcap", "zstd"],
];
const SPEEDS = [0.1, 0.2, 0.5, 1, 2, 5, 10];

export class Bag {
  constructor(link, words, main, place) {
    this.link = link;
    this.place = place;
    this.name = words.get("file") ?? "";
    this.problem = h("p", { class: "error", role: "alert" });
    this.files = h("select", { class: "grow", "aria-label": "Bag", onchange: () => this.choose(this.files.value) });
    this.recorder = new Recorder(link, (fields) => this.endpoint.send(fields));
    this.player = new Player(link, (fields) => this.endpoint.send(fields));
    this.empty = h("p", { class: "empty" });
    this.recordButton = h(
      "button",
      { type: "button", "aria-expanded": "false", onclick: () => this.recorder.toggle(this.recordButton) },
      h("span", { class: "dot record" }),
      "Record …",
    );
    main.append(
      h(
        "div",
        { class: "bar" },
        this.files,
        h(
          "button",
          {
            type: "button",
            title: "Look for bags again",
            "aria-label": "Look for bags again",
            onclick: () => this.endpoint.send({ op: "list" }),
          },
          "↻",
        ),
        this.recordButton,
        this.recorder.status,
      ),
      this.problem,
      this.recorder.element,
      this.player.element,
      this.empty,
    );
    this.onKey = (event) => {
      if (place.isActive()) this.player.key(event);
    };
    addEventListener("keydown", this.onKey);
    this.endpoint = new Endpoint(link, PROTOCOL, {
      opened: () => {
        this.say("");
        this.endpoint.send({ op: "list" });
        if (this.name) this.endpoint.send({ op: "open", name: this.name });
      },
      closed: () => this.player.leave(),
      writes: (writes) => {
        this.writes = writes;
        this.recordButton.disabled = this.files.disabled = !writes;
      },
      files: (files, { folder, given }) => this.showFiles(files, folder, given),
      recording: (recording) => this.recorder.show(recording),
      bag: (bag) => {
        this.say(
          bag.left_out ? t("Left out, as they cannot be converted to ROS 1: {topics}", { topics: bag.left_out }) : "",
        );
        this.player.open(bag);
        setText(this.empty, bag.topics.length ? "" : t("{name} has no messages.", { name: bag.name }));
      },
      state: (state) => this.player.show(state),
      density: (density) => this.player.showDensity(density),
      exported: (tables) => this.player.showExported(tables),
      binary: (data) => this.player.received(data),
      error: (text) => {
        this.player.showExported(null);
        this.say(text);
      },
    });
  }

  close() {
    removeEventListener("keydown", this.onKey);
    this.endpoint.close();
    this.recorder.close();
    this.player.close();
  }

  say(text) {
    setText(this.problem, text);
  }

  showFiles(files, folder, given) {
    this.files.title = t("Bags in {folder} and below", { folder });
    fill(
      this.files,
      h("option", { value: "" }, files.length ? t("choose a bag") : t("no bag in {folder}", { folder })),
      files.map(([name, size, modified]) =>
        h(
          "option",
          { value: name },
          `${name}  ·  ${sizeText(size)}  ·  ${new Date(modified * 1000).toLocaleString(language)}`,
        ),
      ),
    );
    if (!this.name && given.length && !this.player.bag) this.choose(given[0]);
    this.files.value = this.name;
    if (!this.player.bag)
      setText(
        this.empty,
        this.writes === false
          ? ""
          : files.length
            ? t("Choose a bag to look into it, or record one.")
            : t("There is no bag in {folder} yet: record one.", { folder }),
      );
  }

  choose(name) {
    this.name = name;
    this.place.remember(name ? { file: name } : {});
    this.say("");
    this.player.leave();
    if (name && !this.recorder.element.hidden && !this.recorder.isRecording) this.recorder.toggle(this.recordButton);
    this.endpoint.send(name ? { op: "open", name } : { op: "close" });
  }
}

// --- recording

class Recorder {
  constructor(link, send) {
    this.link = link;
    this.send = send;
    this.rows = new Map();
    this.chosen = new Set();
    this.list = h("div", { class: "record-topics" });
    this.all = h("input", { type: "checkbox", onchange: () => this.chooseAll(this.all.checked) });
    this.filter = h("input", {
      type: "search",
      placeholder: "Filter topics",
      "aria-label": "Filter topics",
      oninput: () => this.showFiltered(),
    });
    this.name = h("input", { type: "text", "aria-label": "Name of the recording", autocomplete: "off", size: 24 });
    this.format = h(
      "select",
      { "aria-label": "Format" },
      COMPRESSIONS.map(([suffix, compression], number) =>
        h("option", { value: number }, compression === "none" ? suffix : `${suffix}, ${compression}`),
      ),
    );
    this.start = h("button", { type: "submit", class: "primary" }, "Record");
    this.count = h("span", { class: "muted" });
    this.empty = h("p", { class: "muted" });
    this.element = h(
      "form",
      {
        class: "panel recorder",
        hidden: true,
        onsubmit: (event) => {
          event.preventDefault();
          this.record();
        },
      },
      h("div", { class: "bar" }, h("label", {}, this.all, t("all")), this.filter, this.count),
      this.list,
      this.empty,
      h("div", { class: "bar" }, h("label", {}, "Name", this.name), this.format, this.start),
    );
    this.text = h("span", { class: "num" });
    this.stop = h(
      "button",
      {
        type: "button",
        class: "stop",
        onclick: () => {
          this.stop.disabled = true;
          this.send({ op: "stop" });
        },
      },
      "Stop",
    );
    this.status = h(
      "span",
      { class: "bar recording", role: "status", hidden: true },
      h("span", { class: "dot live" }),
      this.text,
      this.stop,
    );
    this.error = h("span", { class: "error" });
    this.element.append(this.error);
    this.ending = link.watch(["channels"], () => this.update());
    this.timer = setInterval(() => this.refresh(), 500);
  }

  close() {
    this.ending();
    clearInterval(this.timer);
    for (const row of this.rows.values()) row.end?.();
  }

  toggle(button) {
    this.element.hidden = !this.element.hidden;
    button.setAttribute("aria-expanded", String(!this.element.hidden));
    if (this.element.hidden) return;
    const now = new Date();
    const two = (value) => String(value).padStart(2, "0");
    this.name.value = [
      now.getFullYear(),
      two(now.getMonth() + 1),
      two(now.getDate()),
      two(now.getHours()),
      two(now.getMinutes()),
      two(now.getSeconds()),
    ].join("-");
    this.update();
  }

  update() {
    if (this.element.hidden) return;
    const { channels } = this.link;
    for (const [topic, row] of this.rows) {
      if (channels.has(topic)) continue;
      row.end?.();
      row.element.remove();
      this.rows.delete(topic);
    }
    let before = null;
    for (const [topic, { type }] of channels) {
      if (!this.rows.has(topic)) this.rows.set(topic, this.makeRow(topic, type));
      const { element } = this.rows.get(topic);
      const next = before ? before.nextSibling : this.list.firstChild;
      if (element !== next) this.list.insertBefore(element, next);
      before = element;
    }
    setText(this.empty, channels.size ? "" : t("Nothing is published yet."));
    this.showFiltered();
    this.showCount();
  }

  makeRow(topic, type) {
    const box = h("input", {
      type: "checkbox",
      checked: this.chosen.has(topic),
      onchange: () => {
        if (box.checked) this.chosen.add(topic);
        else this.chosen.delete(topic);
        this.measure(row);
        this.showCount();
      },
    });
    const row = {
      topic,
      type,
      box,
      end: null,
      rate: new Rate(),
      hz: h("span", { class: "num" }),
      bytes: h("span", { class: "num" }),
    };
    row.element = h(
      "label",
      { class: "record-row" },
      box,
      h("span", { class: "name" }, topic),
      h("span", { class: "type" }, type),
      row.hz,
      row.bytes,
    );
    row.element.dataset.topic = topic;
    this.measure(row);
    return row;
  }

  measure(row) {
    if (row.end || (HEAVY.has(row.type) && !row.box.checked)) return;
    row.end = this.link.subscribe({ topic: row.topic, mode: "latest", isCounted: true }, ({ count = 0, bytes = 0 }) =>
      row.rate.add(performance.now() / 1000, count, bytes),
    );
  }

  refresh() {
    if (this.element.hidden) return;
    for (const { rate, hz, bytes, end } of this.rows.values()) {
      const found = rate.at(performance.now() / 1000);
      setText(
        hz,
        found ? `${found.hz < 10 ? found.hz.toFixed(2) : found.hz.toFixed(1)} Hz` : end ? "–" : t("choose to measure"),
      );
      setText(bytes, found ? bandwidth(found.bytes) : "");
    }
  }

  showFiltered() {
    const words = this.filter.value.toLowerCase().split(/\s+/);
    for (const { element, topic, type } of this.rows.values())
      element.hidden = !words.every((word) => `${topic} ${type}`.toLowerCase().includes(word));
  }

  chooseAll(isChosen) {
    for (const row of this.rows.values()) {
      if (row.element.hidden) continue;
      row.box.checked = isChosen;
      if (isChosen) this.chosen.add(row.topic);
      else this.chosen.delete(row.topic);
      this.measure(row);
    }
    this.showCount();
  }

  showCount() {
    setText(this.count, t("{count} of {all} topics", { count: this.chosen.size, all: this.rows.size }));
    this.start.disabled = !this.chosen.size || this.isRecording;
  }

  record() {
    const [suffix, compression] = COMPRESSIONS[this.format.value];
    setText(this.error, "");
    this.send({ op: "record", name: this.name.value.trim(), suffix, compression, topics: [...this.chosen] });
  }

  show(recording) {
    this.isRecording = Boolean(recording && !recording.is_ended);
    this.stop.hidden = !this.isRecording;
    if (!this.isRecording) this.stop.disabled = false;
    this.status.hidden = !recording;
    this.status.classList.toggle("ended", !this.isRecording);
    if (recording)
      setText(
        this.text,
        `${recording.name} · ${clockText(recording.seconds, 0.1)} · ${sizeText(recording.size)}${this.isRecording ? "" : recording.error ? "" : ` · ${t("saved")}`}`,
      );
    setText(this.error, recording?.error ?? "");
    this.showCount();
  }
}

// --- a bag

class Player {
  constructor(link, send) {
    this.link = link;
    this.send = send;
    this.bag = null;
    this.axis = new Axis(1, 1);
    const button = (text, title, onclick, properties = {}) =>
      h("button", { type: "button", title, "aria-label": title, onclick, ...properties }, text);
    this.playButton = button("▶", "Play (space)", () => this.toggle(), { class: "primary play" });
    this.speed = h("input", {
      type: "range",
      min: -1,
      max: 1,
      step: 0.01,
      value: "0",
      "aria-label": "Speed",
      onchange: () => this.setSpeed(),
      oninput: () => this.setSpeed(),
      ondblclick: () => {
        this.speed.value = "0";
        this.setSpeed();
      },
    });
    this.speedText = h("span", { class: "num speed" }, "1×");
    this.loop = h("input", { type: "checkbox", onchange: () => this.send({ op: "play", looping: this.loop.checked }) });
    this.publishing = h("input", { type: "checkbox", onchange: () => this.publish() });
    this.clock = h("input", { type: "checkbox", onchange: () => this.publish() });
    this.clockLabel = h(
      "label",
      { title: "Publish the bag's time, as rosbag play --clock", hidden: true },
      this.clock,
      "/clock",
    );
    this.export = h(
      "select",
      { "aria-label": "Export the shown topics", onchange: () => this.exportShown() },
      h("option", { value: "" }, "Export …"),
      h("option", { value: "csv" }, "CSV"),
      h("option", { value: "parquet" }, "Parquet"),
    );
    this.exported = h("p", { class: "muted", role: "status", hidden: true });
    this.publishLabel = h("label", { class: "publish-switch" }, this.publishing, "Publish");
    this.now = h("output", { class: "num now" });
    this.date = h("span", { class: "muted num" });
    this.labels = h("div", { class: "bag-labels" });
    this.canvas = h("canvas", {
      class: "bag-rows",
      tabindex: 0,
      role: "slider",
      "aria-label": "Time in the bag",
      "aria-valuemin": 0,
    });
    this.head = h("div", { class: "playhead" });
    this.area = h("div", { class: "bag-area" }, this.canvas, this.head);
    this.moments = h("div", { class: "moments" });
    this.element = h(
      "div",
      { class: "bag", hidden: true },
      h(
        "div",
        { class: "panel bag-panel" },
        h(
          "div",
          { class: "bar transport" },
          button("❙◀◀", "To the start (Home)", () => this.seek(0)),
          button("◀❙", "To the message before (left arrow)", () => this.send({ op: "back" })),
          this.playButton,
          button("❙▶", "To the next message (right arrow)", () => this.send({ op: "step" })),
          this.now,
          this.date,
          h("span", { class: "spring" }),
          h("label", { title: "Double click: 1×" }, "Speed", this.speed, this.speedText),
          h("label", {}, this.loop, t("loop")),
          this.publishLabel,
          this.clockLabel,
          this.export,
        ),
        this.exported,
        h("div", { class: "bag-timeline" }, this.labels, this.area),
      ),
      this.moments,
    );
    this.listen();
    this.observer = new ResizeObserver(() => this.resized());
    this.observer.observe(this.area);
    this.onTheme = () => this.draw();
    link.addEventListener("theme", this.onTheme);
    this.media = matchMedia("(prefers-color-scheme: dark)");
    this.media.addEventListener("change", this.onTheme);
  }

  close() {
    this.leave();
    this.observer.disconnect();
    this.link.removeEventListener("theme", this.onTheme);
    this.media.removeEventListener("change", this.onTheme);
  }

  leave() {
    this.bag = null;
    this.state = null;
    this.element.hidden = true;
    clearTimeout(this.asking);
  }

  open(bag) {
    this.bag = bag;
    this.state = null;
    this.axis = new Axis(bag.length, Math.max(1, this.area.clientWidth));
    this.rows = [];
    this.cards = new Map();
    let top = RULER;
    for (const [number, [name, type, count, definition]] of bag.topics.entries()) {
      const height = IMAGES.has(type) ? IMAGE_ROW : ROW;
      this.rows.push({
        number,
        name,
        type,
        count,
        definition,
        top,
        height,
        counts: [],
        thumbnails: new Map(),
        apart: APART,
        isShown: false,
        isPublished: name !== "/clock",
      });
      top += height;
    }
    this.height = top;
    const isOfRos2 = bag.format.endsWith("ROS 2");
    fill(
      this.labels,
      h(
        "div",
        { class: "bag-corner muted" },
        `${t("{count} topics", { count: bag.topics.length })}${isOfRos2 ? ` · ${t("of ROS 2, converted")}` : ""} · ${new Date(bag.start * 1000).toLocaleString(language)}`,
      ),
      this.rows.map((row) => this.label(row)),
    );
    fill(this.moments);
    const order = [...this.rows].sort(
      (one, other) => Number(IMAGES.has(other.type)) - Number(IMAGES.has(one.type)) || other.count - one.count,
    );
    for (const row of order.slice(0, MAX_SHOWN_FIRST)) this.setShown(row, true);
    this.publishing.checked = false;
    this.clock.checked = false;
    this.clockLabel.hidden = true;
    this.showExported(null);
    this.canvas.setAttribute("aria-valuemax", bag.length);
    this.element.hidden = !this.rows.length;
    this.resized();
    this.sendShown();
  }

  label(row) {
    row.box = h("input", {
      type: "checkbox",
      "aria-label": t("show {name}", { name: row.name }),
      title: "Show its messages",
      onchange: () => {
        this.setShown(row, row.box.checked);
        this.sendShown();
      },
    });
    row.publishBox = h("input", {
      type: "checkbox",
      class: "publish-box",
      checked: row.isPublished,
      "aria-label": t("publish {name}", { name: row.name }),
      title: "Publish this topic",
      hidden: true,
      onchange: () => {
        row.isPublished = row.publishBox.checked;
        this.publish();
      },
    });
    const element = h(
      "div",
      { class: "bag-label", title: `${row.name}\n${row.type}\n${t("{count} messages", { count: row.count })}` },
      row.box,
      h("span", { class: "swatch", style: null }),
      h("span", { class: "name" }, row.name),
      h("span", { class: "num" }, String(row.count)),
      row.publishBox,
    );
    element.style.height = `${row.height}px`;
    element.querySelector(".swatch").style.background = color(row.type);
    element.dataset.topic = row.name;
    return element;
  }

  // --- control

  toggle() {
    if (!this.state) return;
    this.send({ op: "play", paused: !(this.state.paused || this.state.ended) });
  }

  seek(time) {
    if (!this.bag) return;
    this.send({ op: "play", seek: time });
    this.wanted = { time, until: performance.now() + 400 };
    this.place(time);
  }

  setSpeed() {
    const rate = Number((10 ** Number(this.speed.value)).toPrecision(2));
    const near = SPEEDS.find((each) => Math.abs(Math.log10(each / rate)) < 0.03);
    this.send({ op: "play", rate: near ?? rate });
  }

  publish() {
    const isOn = this.publishing.checked;
    for (const { publishBox } of this.rows) publishBox.hidden = !isOn;
    this.clockLabel.hidden = !isOn;
    this.send({
      op: "publish",
      topics: isOn ? this.rows.filter((row) => row.isPublished).map(({ name }) => name) : [],
      clock: isOn && this.clock.checked,
    });
  }

  /** Write the shown topics as tables into the folder of the command. */
  exportShown() {
    this.send({ op: "export", topics: [...this.cards.keys()], format: this.export.value });
    this.export.value = "";
    this.exported.hidden = false;
    setText(this.exported, t("writing …"));
  }

  showExported(tables) {
    this.exported.hidden = !tables;
    const lines = (tables ?? []).map(
      ([file, rows, columns, leftOut]) =>
        t("{file}: {rows} rows, {columns} columns", { file, rows, columns }) +
        (leftOut.length ? t(", without {fields}", { fields: leftOut.join(", ") }) : ""),
    );
    setText(this.exported, lines.join(" · "));
  }

  key(event) {
    if (!this.bag || this.element.hidden || event.ctrlKey || event.altKey || event.metaKey) return;
    // Buttons and switches have keys of their own: space and enter.
    const isField = event.target.closest("input:not([type=checkbox]), select, textarea");
    if (isField || (event.key === " " && event.target.closest("input, button, a"))) return;
    const action = {
      " ": () => this.toggle(),
      ArrowLeft: () => this.send({ op: "back" }),
      ArrowRight: () => this.send({ op: "step" }),
      Home: () => this.seek(0),
      End: () => this.seek(this.bag.length),
    }[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }

  listen() {
    const { canvas } = this;
    const at = (event) => event.clientX - canvas.getBoundingClientRect().left;
    let drag = null;
    canvas.addEventListener("pointerdown", (event) => {
      if (!this.bag || event.button > 1) return;
      canvas.setPointerCapture(event.pointerId);
      drag = { x: at(event), isPan: event.shiftKey || event.button === 1 };
      if (!drag.isPan) this.seek(this.axis.time(at(event)));
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!drag) return;
      if (drag.isPan) {
        this.axis.pan(drag.x - at(event));
        drag.x = at(event);
        this.moved();
      } else this.seek(this.axis.time(at(event)));
    });
    for (const name of ["pointerup", "pointercancel"])
      canvas.addEventListener(name, () => {
        drag = null;
      });
    canvas.addEventListener(
      "wheel",
      (event) => {
        if (!this.bag) return;
        event.preventDefault();
        if (event.shiftKey || Math.abs(event.deltaX) > Math.abs(event.deltaY))
          this.axis.pan(event.deltaX || event.deltaY);
        else this.axis.zoom(Math.exp(event.deltaY * 0.0015), at(event));
        this.moved();
      },
      { passive: false },
    );
    canvas.addEventListener("dblclick", () => {
      this.axis.fit();
      this.moved();
    });
  }

  // --- what the server sends

  show(state) {
    if (!this.bag) return;
    this.state = state;
    const isPlaying = !state.paused && !state.ended;
    setText(this.playButton, isPlaying ? "❙❙" : "▶");
    this.playButton.title = isPlaying ? t("Pause (space)") : t("Play (space)");
    this.playButton.setAttribute("aria-label", this.playButton.title);
    this.playButton.setAttribute("aria-pressed", String(isPlaying));
    setText(this.speedText, `${Number(state.rate.toPrecision(2))}×`);
    if (document.activeElement !== this.speed) this.speed.value = String(Math.log10(state.rate));
    this.loop.checked = state.looping;
    this.publishLabel.classList.toggle("on", state.published.length > 0 || state.clock);
    if (this.wanted && performance.now() < this.wanted.until && Math.abs(state.time - this.wanted.time) > 0.5) return;
    this.wanted = null;
    if (isPlaying && this.axis.follow(state.time)) this.moved();
    this.place(state.time);
  }

  place(time) {
    const x = this.axis.x(time);
    this.head.hidden = x < 0 || x > this.axis.width;
    this.head.style.transform = `translateX(${x.toFixed(1)}px)`;
    this.head.style.height = `${this.height}px`;
    setText(this.now, `${clockText(time)} / ${clockText(this.bag.length)}`);
    setText(this.date, new Date((this.bag.start + time) * 1000).toLocaleTimeString(language));
    this.canvas.setAttribute("aria-valuenow", time.toFixed(3));
    this.canvas.setAttribute("aria-valuetext", clockText(time));
  }

  showDensity({ start, end, rows }) {
    if (!this.bag) return;
    this.range = { start, end };
    for (const row of this.rows) row.counts = heights(rows[row.name] ?? []);
    this.draw();
  }

  async received(data) {
    if (!this.bag) return;
    const view = new DataView(data);
    const row = this.rows[view.getUint16(1, true)];
    if (!row) return;
    const time = view.getFloat64(3, true);
    const isMoment = view.getUint8(0) === MOMENT;
    const { bag } = this;
    let message;
    let error = "";
    try {
      const definition = this.link.definition(row.type, row.definition);
      if (!definition) throw new Error(t("its definition cannot be read"));
      message = decode(definition, new Uint8Array(data, HEAD_BYTES));
      if (isMoment) this.cards.get(row.name)?.show(message, time);
      if (!isMoment && IMAGES.has(row.type)) {
        const image = await pictureOf(message);
        const isWanted = bag === this.bag;
        if (isWanted) row.thumbnails.set(time, small(image, IMAGE_ROW - 6));
        if (image instanceof ImageBitmap) image.close();
        if (!isWanted) return;
        const apart = row.thumbnails.get(time).width + 6;
        if (apart !== row.apart) {
          row.apart = apart;
          this.moved();
        } else this.draw();
      }
    } catch (failure) {
      error = errorText(failure);
    }
    if (isMoment && error) this.cards.get(row.name)?.fail(error);
  }

  // --- messages of the moment

  setShown(row, isShown) {
    row.isShown = isShown;
    row.box.checked = isShown;
    if (!isShown) {
      this.cards.get(row.name)?.element.remove();
      this.cards.delete(row.name);
    } else if (!this.cards.has(row.name)) {
      const card = new Card(row, this.bag.name);
      this.cards.set(row.name, card);
      this.moments.append(card.element);
    }
  }

  sendShown() {
    this.send({ op: "show", topics: [...this.cards.keys()] });
  }

  // --- drawing

  resized() {
    if (!this.bag || !this.area.clientWidth) return;
    this.axis.width = this.area.clientWidth;
    const scale = devicePixelRatio;
    this.canvas.width = Math.round(this.axis.width * scale);
    this.canvas.height = Math.round(this.height * scale);
    this.canvas.style.height = `${this.height}px`;
    this.moved();
    this.place(this.state?.time ?? 0);
  }

  /** The axis shows something else: draw what is known, and request what fits. */
  moved() {
    this.draw();
    if (this.state) this.place(this.state.time);
    clearTimeout(this.asking);
    this.asking = setTimeout(() => this.request(), 60);
  }

  request() {
    const { start, end, width } = this.axis;
    this.send({ op: "density", start, end, bins: Math.max(1, Math.floor(width / 2)) });
    for (const row of this.rows) {
      if (!IMAGES.has(row.type)) continue;
      const times = [];
      for (let x = 1; x < width; x += row.apart) times.push(this.axis.time(x));
      if (row.thumbnails.size > 300) row.thumbnails.clear();
      this.send({ op: "thumbnails", topic: row.name, times });
    }
  }

  draw() {
    if (!this.bag || !this.canvas.width) return;
    const context = this.canvas.getContext("2d");
    const style = getComputedStyle(document.documentElement);
    const css = (name) => style.getPropertyValue(name).trim();
    const { axis } = this;
    context.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
    context.clearRect(0, 0, axis.width, this.height);
    this.drawRuler(context, css);
    for (const row of this.rows) {
      context.fillStyle = css("--line");
      context.fillRect(0, row.top, axis.width, 1);
      this.drawCounts(context, row);
      if (row.thumbnails.size) this.drawThumbnails(context, row, css);
    }
  }

  drawRuler(context, css) {
    const { axis } = this;
    const { step, times } = axis.ticks();
    context.font = "11px system-ui, sans-serif";
    context.textBaseline = "middle";
    for (const time of times) {
      const x = Math.round(axis.x(time)) + 0.5;
      context.fillStyle = css("--line");
      context.fillRect(x, RULER - 7, 1, this.height);
      context.fillStyle = css("--muted");
      const text = clockText(time, step);
      context.textAlign = x < 20 ? "left" : x > axis.width - 24 ? "right" : "center";
      context.fillText(text, x, RULER / 2 - 2);
    }
  }

  drawCounts(context, row) {
    if (!row.counts.length || !this.range) return;
    const { axis } = this;
    const isImage = IMAGES.has(row.type);
    const room = isImage ? 8 : row.height - 8;
    const bottom = row.top + row.height - 3;
    const step = (this.range.end - this.range.start) / row.counts.length;
    context.fillStyle = color(row.type);
    row.counts.forEach((height, number) => {
      if (!height) return;
      const x = axis.x(this.range.start + number * step);
      const width = Math.max(1.5, axis.x(this.range.start + (number + 1) * step) - x);
      context.fillRect(x, bottom - height * room, width, height * room);
    });
  }

  drawThumbnails(context, row, css) {
    const { axis } = this;
    let free = -Infinity;
    for (const [time, picture] of [...row.thumbnails].sort(([one], [other]) => one - other)) {
      const x = Math.max(0, Math.min(axis.x(time), axis.width - picture.width));
      if (axis.x(time) < -picture.width || axis.x(time) > axis.width || x < free) continue;
      const y = row.top + 3;
      context.drawImage(picture, x, y);
      context.strokeStyle = css("--line");
      context.strokeRect(x + 0.5, y + 0.5, picture.width - 1, picture.height - 1);
      free = x + picture.width + 4;
    }
  }
}

// The message of the moment of one topic.
class Card {
  constructor(row, bag) {
    this.row = row;
    this.time = h("span", { class: "num muted" });
    this.problem = h("p", { class: "error" });
    this.isImage = IMAGES.has(row.type);
    this.canvas = this.isImage
      ? h("canvas", { class: "image", role: "img", width: 0, height: 0, "aria-label": row.name })
      : null;
    // Its links plot the whole bag.
    this.tree = this.isImage ? null : new Tree(`${bag}:${row.name}`);
    this.body = h("div", { class: this.isImage ? "card-image" : "fields" }, this.canvas ?? this.tree.element);
    this.waiting = h("p", { class: "muted" }, "No message yet at this time.");
    this.element = h(
      "section",
      { class: `panel card${this.isImage ? " wide" : ""}` },
      h("h2", {}, h("span", { class: "name" }, row.name), h("span", { class: "type" }, row.type), this.time),
      this.problem,
      this.waiting,
      this.body,
    );
    this.element.dataset.topic = row.name;
  }

  async show(message, time) {
    this.waiting.hidden = true;
    setText(this.problem, "");
    setText(this.time, clockText(time));
    if (!this.isImage) {
      this.tree.show(message);
      return;
    }
    // While one is decoded only the newest waits, which may be the last one: the player is paused there.
    this.next = message;
    if (this.isDecoding) return;
    this.isDecoding = true;
    while (this.next) {
      const newest = this.next;
      this.next = null;
      try {
        const image = await pictureOf(newest);
        if (this.canvas.width !== image.width || this.canvas.height !== image.height) {
          this.canvas.width = image.width;
          this.canvas.height = image.height;
        }
        this.canvas.getContext("2d").drawImage(image, 0, 0);
        if (image instanceof ImageBitmap) image.close();
      } catch (error) {
        this.fail(error.message);
      }
    }
    this.isDecoding = false;
  }

  fail(text) {
    setText(this.problem, text);
  }
}

/** Return what a canvas can draw of an image message. Throws Error. */
async function pictureOf(message) {
  const found = "encoding" in message ? message : await decompressed(message);
  if (!("encoding" in found)) return found.bitmap;
  const { rgba, width, height } = pixelsOf(found);
  const canvas = new OffscreenCanvas(width, height);
  canvas.getContext("2d").putImageData(new ImageData(rgba, width, height), 0, 0);
  return canvas;
}

function small(image, height) {
  const width = Math.max(1, Math.min(Math.round((image.width * height) / image.height), WIDEST));
  const canvas = new OffscreenCanvas(width, height);
  const context = canvas.getContext("2d");
  context.imageSmoothingQuality = "high";
  context.drawImage(image, 0, 0, width, height);
  return canvas;
}

/** Return the color of a type: the same in every bag, readable on light and dark. */
function color(type) {
  let hash = 7;
  for (const letter of type) hash = (hash * 31 + letter.charCodeAt(0)) % 360;
  return `hsl(${hash} 55% 52%)`;
}
