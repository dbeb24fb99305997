// Plots of numbers of messages: paths of fields, several y axes, zoom and pan while they stream, CSV and PNG.

import { Axes, titleOf } from "../axes.js";
import { BagPlot, bagPathOf } from "../bag_plot.js";
import { KINDS, derivedOf, pairs, rangeOf } from "../derived.js";
import { download, fill, h, number, refill, setText, uniqueId } from "../dom.js";
import { numericPaths } from "../paths.js";
import { Samples, csv, drawn } from "../samples.js";
import { t } from "../texts.js";
import { STEPS, tickTexts } from "../ticks.js";

const WINDOWS = [
  ["5", "5 s"],
  ["10", "10 s"],
  ["30", "30 s"],
  ["60", "1 min"],
  ["300", "5 min"],
  ["", "all"],
];
const USUAL_WINDOW = "10";
const MAX_PAIRS = 5000; // points of one series over another
const FRAME_MS = 33;
const QUIET_MS = 300; // without another change, until it is in the address
const COLORS = [
  "#2f7ed8",
  "#e4572e",
  "#2a9d5c",
  "#a05cc7",
  "#c98a00",
  "#0c9fb0",
  "#d6458b",
  "#7a7f87",
  "#6b8e23",
  "#8c5a3c",
];

export class Plot {
  constructor(link, words, main, place) {
    this.link = link;
    this.place = place;
    this.ends = new Map(); // path -> what ends its subscription
    this.series = new Map(); // label -> {label, path, samples, color, axis, isHidden}
    this.removed = new Set(); // labels of series that the user removed while others of their path are shown
    this.problems = new Map(); // path without a series -> why: an error, or "" while its topic is not there
    this.origin = null;
    this.zoom = null; // {min, max} of time, null: it follows
    this.isPaused = words.get("paused") === "1";
    this.pausedAt = null;
    this.chart = null;
    this.isDirty = true;
    this.ranges = new Map(); // scale -> range of its values, if one series is over another
    this.axes = new Axes(words, (isBuilt) => {
      if (isBuilt) this.rebuild();
      this.isDirty = true;
      clearTimeout(this.unsaved);
      this.unsaved = setTimeout(() => this.remember(), QUIET_MS);
    });
    this.over = words.get("x") ?? ""; // label of the series on the x axis; time if it is empty
    // label -> kind, if it is not as it comes
    this.kinds = new Map(words.getAll("show").map((each) => each.split(" ", 2).reverse()));

    this.known = h("datalist", { id: uniqueId("paths") });
    this.input = h("input", {
      class: "grow",
      list: this.known.id,
      placeholder: "/topic/field, /topic/a[0:5]",
      "aria-label": "What to plot",
      autocomplete: "off",
    });
    this.waiting = h("div", { role: "status" });
    this.bags = null; // reads bags, after the first path of one, or once its button was pressed
    this.bagFields = []; // paths of the chosen bag
    this.bagChoice = h("select", {
      "aria-label": "Plot paths of this bag",
      onchange: () => this.chooseBag(this.bagChoice.value),
    });
    this.bagState = h("span", { class: "muted", role: "status" });
    this.bagRow = h("div", { class: "bar", hidden: true }, h("label", {}, t("Bag"), this.bagChoice), this.bagState);
    this.bagButton = h(
      "button",
      {
        type: "button",
        title: "Plot a whole bag, without playing it",
        "aria-expanded": "false",
        onclick: () => this.showBags(this.bagRow.hidden),
      },
      "Bags",
    );
    this.window = h(
      "select",
      {
        "aria-label": "Time shown",
        onchange: () => {
          this.live();
          this.remember();
        },
      },
      WINDOWS.map(([value, name]) => h("option", { value }, t(name))),
    );
    const wanted = words.get("window") ?? USUAL_WINDOW;
    this.window.value = wanted === "all" ? "" : WINDOWS.some(([value]) => value === wanted) ? wanted : USUAL_WINDOW;
    this.axis = h("select", { "aria-label": "The x axis", onchange: () => this.setOver(this.axis.value) });
    this.pauseButton = h("button", { type: "button", onclick: () => this.pause(!this.isPaused) });
    this.liveButton = h(
      "button",
      { type: "button", class: "primary keeps-place", onclick: () => this.live() },
      "Follow",
    );
    this.form = h(
      "form",
      {
        class: "bar",
        onsubmit: (event) => {
          event.preventDefault();
          this.addTyped();
        },
      },
      this.input,
      this.known,
      h("button", { type: "submit", class: "primary" }, "Plot"),
      this.bagButton,
    );
    this.clearButton = h("button", { type: "button", onclick: () => this.clear() }, "Clear");
    this.area = h("div", {
      class: "panel chart",
      tabindex: 0,
      role: "group",
      "aria-label": "Chart: left and right pan, plus and minus zoom, Escape follows",
    });
    this.hint = h(
      "p",
      { class: "empty" },
      "Type a path above, choose “plot” next to a field in Topics, or drag the field here.",
    );
    this.legend = h("div", { class: "legend", role: "list", "aria-label": "Series" });
    main.append(
      this.form,
      this.bagRow,
      h(
        "div",
        { class: "bar" },
        this.pauseButton,
        this.window,
        h("label", {}, "x axis", this.axis),
        this.axes.button,
        this.liveButton,
        this.axes.autoButton,
        this.clearButton,
        h("button", { type: "button", title: "Remove all series", onclick: () => this.removeAll() }, "Remove all"),
        h("button", { type: "button", onclick: () => this.saveCsv() }, "CSV"),
        h("button", { type: "button", onclick: () => this.savePng() }, "PNG"),
        h("span", { class: "muted tips" }, t("drag: zoom · wheel: zoom · shift and wheel: pan · double click: follow")),
      ),
      this.axes.element,
      this.area,
      this.waiting,
      this.legend,
    );
    this.area.append(this.hint);
    for (const element of [this.area, this.form, this.legend]) {
      element.addEventListener("dragover", (event) => {
        if (event.dataTransfer.types.includes("text/plain")) event.preventDefault();
      });
      element.addEventListener("drop", (event) => this.dropped(event));
    }
    this.pause(this.isPaused);
    this.showAxis();

    this.ending = [link.watch(["channels"], () => this.suggest())];
    const theme = () => this.rebuild();
    link.addEventListener("theme", theme);
    this.ending.push(() => link.removeEventListener("theme", theme));
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(this.area);
    this.area.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    this.area.addEventListener("keydown", (event) => this.key(event));
    for (const path of words.getAll("path")) this.add(path);
    this.timer = setInterval(() => this.draw(), FRAME_MS);
  }

  close() {
    clearInterval(this.timer);
    clearTimeout(this.unsaved);
    for (const end of [...this.ending, ...this.ends.values()]) end();
    this.observer.disconnect();
    this.bags?.close();
    this.chart?.destroy();
  }

  suggest() {
    const paths = [...this.bagFields];
    for (const { topic, type, schema } of this.link.channels.values()) {
      const definition = this.link.definition(type, schema);
      if (definition && paths.length < 2000) paths.push(...numericPaths(definition, 60).map((path) => topic + path));
    }
    this.known.replaceChildren(...paths.map((value) => h("option", { value })));
    this.showProblems();
  }

  /** Take over a field that was dragged here from the topics. */
  dropped(event) {
    const path = event.dataTransfer.getData("text/plain").trim();
    event.preventDefault();
    if (path.startsWith("/") || bagPathOf(path)) this.add(path);
  }

  addTyped() {
    const path = this.input.value.trim();
    if (!path) return;
    const whole = path.startsWith("/") || bagPathOf(path) ? path : `/${path}`;
    this.add(this.bagChoice.value && !bagPathOf(whole) ? `${this.bagChoice.value}:${whole}` : whole);
    this.input.value = "";
  }

  add(path) {
    if (this.ends.has(path)) return;
    const operands = bagPathOf(path);
    this.problems.set(path, "");
    if (this.isOfBags === !operands) {
      // The times of a bag and of now have nothing in common.
      this.problems.set(path, t("live topics and bags are in separate plots: remove all, or open a second plot"));
      this.ends.set(path, () => {});
    } else if (operands) {
      this.ends.set(path, () => this.bags.remove(path));
      this.origin = 0;
      this.openBags().add(path, operands);
    } else
      this.ends.set(
        path,
        this.link.subscribe({ path, mode: "series" }, (item) => this.received(path, item)),
      );
    this.remember();
    this.showProblems();
    this.showMode();
  }

  /** Return whether the plot shows bags, null if it shows nothing yet. */
  get isOfBags() {
    const [first] = this.ends.keys();
    return first === undefined ? null : Boolean(bagPathOf(first));
  }

  showMode() {
    const isOfBags = this.isOfBags === true;
    this.pauseButton.hidden = this.window.hidden = this.clearButton.hidden = isOfBags;
    setText(this.liveButton, isOfBags ? t("Show all") : t("Follow"));
  }

  showBags(isShown) {
    this.bagRow.hidden = !isShown;
    this.bagButton.setAttribute("aria-expanded", String(isShown));
    if (isShown) this.openBags().list();
    else this.chooseBag("");
  }

  openBags() {
    this.bags ??= new BagPlot(this.link, {
      files: (names) => {
        const chosen = this.bagChoice.value;
        fill(
          this.bagChoice,
          h("option", { value: "" }, names.length ? t("choose a bag") : t("there is no bag")),
          names.map((name) => h("option", { value: name }, name)),
        );
        this.bagChoice.value = names.includes(chosen) ? chosen : "";
      },
      fields: ({ name, topics }) => {
        if (name !== this.bagChoice.value) return;
        this.bagFields = topics.flatMap(([topic, type, definition]) => {
          const known = this.link.definition(type, definition);
          return known ? numericPaths(known, 60).map((path) => `${name}:${topic}${path}`) : [];
        });
        this.suggest();
      },
      shown: (path, series) => this.receivedOfBag(path, series),
      failed: (path, text) => {
        this.problems.set(path, text);
        this.showProblems();
      },
      progress: (share) =>
        setText(this.bagState, share === null ? "" : t("reading: {percent} %", { percent: Math.round(share * 100) })),
      error: (text) => {
        setText(this.bagState, text);
        if (this.isOfBags)
          for (const path of this.ends.keys()) if (this.problems.has(path)) this.problems.set(path, text);
        this.showProblems();
      },
    });
    return this.bags;
  }

  chooseBag(name) {
    this.bagChoice.value = name;
    this.bagFields = [];
    this.suggest();
    if (name) this.openBags().choose(name);
  }

  /** Take over all points of a series of a bag. */
  receivedOfBag(path, { label, times, values, count }) {
    const { bag, minus } = bagPathOf(path);
    const name = minus ? path : `${bag}:${label}`;
    if (this.removed.has(name)) return;
    let series = this.series.get(name);
    if (!series) {
      series = this.makeSeries(name, path);
      this.rebuild();
    }
    if (this.problems.delete(path)) this.showProblems();
    series.raw = new Samples();
    series.raw.append(times, values);
    series.raw.total = count;
    this.setKind(series, series.kind);
  }

  remove(series) {
    this.series.delete(series.label);
    if (![...this.series.values()].some((each) => each.path === series.path)) {
      this.forget(series.path);
    } else {
      series.isRemoved = true;
      this.removed.add(series.label);
    }
    series.row.remove();
    if (this.over === series.label) this.over = "";
    this.kinds.delete(series.label);
    this.axes.choose(series.label, 1);
    this.showAxis();
    this.remember();
    this.rebuild();
  }

  /** Plot a path no longer. */
  forget(path) {
    this.ends.get(path)?.();
    this.ends.delete(path);
    this.problems.delete(path);
    this.remember();
    this.showProblems();
    this.showMode();
  }

  removeAll() {
    for (const series of [...this.series.values()]) this.remove(series);
    for (const path of [...this.ends.keys()]) this.forget(path);
    this.removed.clear();
    this.origin = null;
    this.live();
  }

  remember() {
    const span = this.window.value;
    this.place.remember([
      ...[...this.ends.keys()].map((path) => ["path", path]),
      ...(span === USUAL_WINDOW ? [] : [["window", span || "all"]]),
      ...(this.over ? [["x", this.over]] : []),
      ...[...this.kinds].map(([label, kind]) => ["show", `${kind} ${label}`]),
      ...this.axes.words(),
    ]);
  }

  /** Offer time and each series for the x axis. */
  showAxis() {
    const labels = [...this.series.keys(), ...(this.over && !this.series.has(this.over) ? [this.over] : [])];
    fill(
      this.axis,
      h("option", { value: "" }, t("time")),
      labels.map((label) => h("option", { value: label }, label)),
    );
    this.axis.value = this.over;
  }

  setOver(label) {
    this.over = label;
    this.zoom = null;
    this.remember();
    this.rebuild();
  }

  /** Show a series as a kind of KINDS: all points that are kept are computed again. */
  setKind(series, kind) {
    series.kind = kind;
    series.derived = derivedOf(kind);
    series.samples = series.raw;
    if (series.derived) {
      const { times, values, stamps, count, total } = series.raw;
      series.samples = new Samples();
      series.samples.append(
        times.subarray(0, count),
        series.derived.append(times.subarray(0, count), values.subarray(0, count), stamps?.subarray(0, count)),
      );
      series.samples.total = total;
    }
    this.isDirty = true;
  }

  /** Plot what another view links to, too. */
  accept(words) {
    for (const path of words.getAll("path")) this.add(path);
    return true;
  }

  showProblems() {
    refill(
      this.waiting,
      [...this.problems].map(([path, error]) =>
        h(
          "div",
          { class: "series-missing" },
          h(
            "span",
            { class: error ? "error" : "muted" },
            error ? `${path}: ${error}` : t("waiting for {path}", { path }),
          ),
          h(
            "button",
            {
              type: "button",
              class: "small",
              title: t("Remove {name}", { name: path }),
              onclick: () => this.forget(path),
            },
            "×",
          ),
        ),
      ),
    );
  }

  received(path, item) {
    if (item.error) {
      this.problems.set(path, item.error);
      this.showProblems();
    }
    for (const { label, times, values, stamps } of item.series ?? []) {
      if (this.removed.has(label)) continue;
      let series = this.series.get(label);
      if (!series) {
        series = this.makeSeries(label, path);
        this.rebuild();
      }
      if (this.problems.delete(path)) this.showProblems();
      this.origin ??= times[0];
      // Time that goes back: a simulation or a bag was started again.
      if (times[0] < series.raw.lastTime - 1) {
        series.raw.drop(Infinity);
        this.setKind(series, series.kind);
      }
      series.raw.append(times, values, stamps);
      if (series.derived) series.samples.append(times, series.derived.append(times, values, stamps));
      this.isDirty = true;
    }
  }

  makeSeries(label, path) {
    const used = new Set([...this.series.values()].map((each) => each.color));
    const color = COLORS.find((each) => !used.has(each)) ?? COLORS[this.series.size % COLORS.length];
    const raw = new Samples();
    const series = { label, path, raw, samples: raw, kind: "", derived: null, color, isHidden: false };
    const known = bagPathOf(path) ? "" : (this.kinds.get(label) ?? "");
    if (KINDS.some(([kind]) => kind === known)) this.setKind(series, known);
    const kinds = h(
      "select",
      {
        class: "small",
        "aria-label": t("How {label} is shown", { label }),
        onchange: () => {
          this.setKind(series, kinds.value);
          if (kinds.value) this.kinds.set(label, kinds.value);
          else this.kinds.delete(label);
          this.remember();
        },
      },
      KINDS.map(([kind, name]) => h("option", { value: kind }, t(name))),
    );
    kinds.value = series.kind;
    // Of the extremes of a bag there is no derivative.
    kinds.hidden = Boolean(bagPathOf(path));
    series.value = h("span", { class: "num" });
    series.count = h("span", { class: "muted count" });
    const swatch = h("button", {
      type: "button",
      class: "swatch",
      title: "Show or hide",
      "aria-pressed": "true",
      onclick: () => {
        series.isHidden = !series.isHidden;
        swatch.setAttribute("aria-pressed", String(!series.isHidden));
        this.rebuild();
      },
    });
    swatch.style.background = color;
    series.row = h(
      "div",
      { class: "series", role: "listitem" },
      swatch,
      h("span", { class: "label" }, label),
      series.value,
      series.count,
      kinds,
      this.axes.choice(series),
      h(
        "button",
        {
          type: "button",
          class: "small",
          title: t("Remove {name}", { name: label }),
          onclick: () => this.remove(series),
        },
        "×",
      ),
    );
    series.row.dataset.label = label;
    this.series.set(label, series);
    this.legend.append(series.row);
    this.showAxis();
    return series;
  }

  pause(isPaused) {
    this.isPaused = isPaused;
    this.pausedAt = isPaused ? this.newest() : null;
    this.pauseButton.setAttribute("aria-pressed", String(isPaused));
    setText(this.pauseButton, isPaused ? t("Continue") : t("Pause"));
    this.isDirty = true;
  }

  live() {
    this.zoom = null;
    this.pause(false);
  }

  newest() {
    return Math.max(...[...this.series.values()].map((each) => each.samples.lastTime), -Infinity);
  }

  /** Return the time that is shown: [from, to]. */
  range() {
    if (this.zoom) return [this.zoom.min, this.zoom.max];
    if (this.isOfBags) return [0, Math.max(1e-3, this.newest())];
    const to = Number.isFinite(this.pausedAt) && this.pausedAt !== null ? this.pausedAt : this.newest();
    if (!Number.isFinite(to)) return [0, 1];
    const oldest = Math.min(...[...this.series.values()].map((each) => each.samples.firstTime));
    const from = this.window.value ? to - Number(this.window.value) : oldest;
    return from < to ? [from, to] : [to - 1, to];
  }

  visible() {
    return [...this.series.values()].filter((each) => !each.isHidden && each.label !== this.over);
  }

  rebuild() {
    this.chart?.destroy();
    this.chart = null;
    const shown = this.visible();
    this.hint.hidden = shown.length > 0;
    this.isDirty = true;
    if (!shown.length || !this.area.clientWidth) return;
    const style = getComputedStyle(document.documentElement);
    const text = style.getPropertyValue("--muted").trim();
    const line = style.getPropertyValue("--line").trim();
    const styled = (more) => ({
      stroke: text,
      grid: { stroke: line, width: 1 },
      ticks: { stroke: line, width: 1 },
      font: "12px system-ui",
      ...more,
    });
    if (this.over) {
      this.chart = this.makeOver(shown, styled);
      return;
    }
    const axes = this.axes.drawn(shown, styled);
    const scale = ({ label }) => [
      this.axes.scaleOf(label),
      {
        range: (_, low, high) =>
          this.axes.rangeOf(
            label,
            low === null || low === high ? rangeOf([[low ?? NaN]]) : uPlot.rangeNum(low, high, 0.1, true),
          ),
      },
    ];
    this.chart = new uPlot(
      {
        width: this.area.clientWidth,
        height: this.area.clientHeight,
        padding: [12, axes.some(({ side }) => side === 1) ? 0 : 14, 0, 0],
        legend: { show: false },
        cursor: {
          drag: { x: true, y: false, setScale: false },
          bind: { dblclick: () => () => this.live() },
          points: { size: 6 },
        },
        scales: {
          x: { time: false, range: () => this.range().map((each) => each - (this.origin ?? 0)) },
          ...Object.fromEntries(shown.map(scale)),
        },
        series: [
          {},
          ...shown.map((each) => ({
            label: each.label,
            stroke: each.color,
            width: 1.5,
            scale: this.axes.scaleOf(each.label),
            spanGaps: true,
            points: { size: 6, fill: each.color, show: () => each.samples.count === 1 },
          })),
        ], // a line has two points
        axes: [
          styled({
            incrs: STEPS,
            values: (chart, all, index, space, step) => tickTexts(all, step).map((text) => `${text} s`),
          }),
          ...axes,
        ],
        hooks: {
          setSelect: [
            (chart) => {
              const { left, width } = chart.select;
              if (width < 4) return;
              this.zoom = {
                min: chart.posToVal(left, "x") + this.origin,
                max: chart.posToVal(left + width, "x") + this.origin,
              };
              chart.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
              this.isDirty = true;
            },
          ],
          setCursor: [() => this.showValues()],
        },
      },
      [[], ...shown.map(() => [])],
      this.area,
    );
    this.axes.attach(this.chart);
    this.listenToFingers(this.chart.over);
  }

  /** Return a chart of series over another one. */
  makeOver(shown, styled) {
    const line = (chart, number) => {
      const [xs, ys] = chart.data[number];
      const scale = this.axes.scaleOf(shown[number - 1].label);
      const path = new Path2D();
      xs.forEach((x, index) =>
        path[index ? "lineTo" : "moveTo"](chart.valToPos(x, "x", true), chart.valToPos(ys[index], scale, true)),
      );
      chart.ctx.save();
      chart.ctx.strokeStyle = shown[number - 1].color;
      chart.ctx.lineWidth = 1.5 * devicePixelRatio;
      chart.ctx.stroke(path);
      if (xs.length) {
        // Where it is now.
        const last = xs.length - 1;
        chart.ctx.fillStyle = shown[number - 1].color;
        chart.ctx.beginPath();
        chart.ctx.arc(
          chart.valToPos(xs[last], "x", true),
          chart.valToPos(ys[last], scale, true),
          4 * devicePixelRatio,
          0,
          2 * Math.PI,
        );
        chart.ctx.fill();
      }
      chart.ctx.restore();
      return null;
    };
    const axes = this.axes.drawn(shown, styled);
    const scale = ({ label }) => [
      this.axes.scaleOf(label),
      { range: () => this.axes.rangeOf(label, this.ranges.get(this.axes.scaleOf(label)) ?? [0, 1]) },
    ];
    const chart = new uPlot(
      {
        mode: 2,
        width: this.area.clientWidth,
        height: this.area.clientHeight,
        padding: [12, axes.some(({ side }) => side === 1) ? 0 : 14, 0, 0],
        legend: { show: false },
        cursor: { show: false },
        scales: {
          x: { time: false, range: () => this.ranges.get("x") ?? [0, 1] },
          ...Object.fromEntries(shown.map(scale)),
        },
        series: [
          null,
          ...shown.map(({ label }) => ({
            label,
            paths: line,
            facets: [
              { scale: "x", auto: true },
              { scale: this.axes.scaleOf(label), auto: true },
            ],
          })),
        ],
        axes: [
          styled({
            label: this.over,
            labelSize: 22,
            labelFont: "12px system-ui",
            incrs: STEPS,
            values: (each, all, index, space, step) => tickTexts(all, step),
          }),
          ...axes,
        ],
      },
      [null, ...shown.map(() => [[], []])],
      this.area,
    );
    this.axes.attach(chart);
    return chart;
  }

  resize() {
    if (!this.chart) this.rebuild();
    else if (this.area.clientWidth)
      this.chart.setSize({ width: this.area.clientWidth, height: this.area.clientHeight });
  }

  wheel(event) {
    if (!this.chart || this.over || this.origin === null) return;
    event.preventDefault();
    const by = event.deltaX || (event.shiftKey ? event.deltaY : 0);
    const left = event.clientX - this.chart.over.getBoundingClientRect().left;
    if (by) this.pan(0.0015 * by);
    else this.zoomBy(Math.exp(event.deltaY * 0.002), this.chart.posToVal(Math.max(0, left), "x") + this.origin);
  }

  key(event) {
    if (event.target !== this.area || event.ctrlKey || event.altKey || event.metaKey || this.origin === null) return;
    const act = {
      ArrowLeft: () => this.pan(-0.1),
      ArrowRight: () => this.pan(0.1),
      "+": () => this.zoomBy(0.5),
      "-": () => this.zoomBy(2),
      Escape: () => this.live(),
    }[event.key];
    if (!act) return;
    event.preventDefault();
    act();
  }

  /** Let one finger pan the time, and two zoom it. */
  listenToFingers(over) {
    const fingers = new Map(); // pointer -> x
    over.addEventListener("pointerdown", ({ pointerType, pointerId, clientX }) => {
      if (pointerType === "touch") fingers.set(pointerId, clientX);
    });
    over.addEventListener("pointermove", ({ pointerId, clientX }) => {
      if (!fingers.has(pointerId) || this.origin === null) return;
      const before = [...fingers.values()];
      const after = [...fingers.set(pointerId, clientX).values()];
      const { left, width } = over.getBoundingClientRect();
      const [from, to] = this.range();
      if (after.length === 1) this.pan((before[0] - after[0]) / width);
      if (after.length === 2)
        this.zoomBy(
          Math.abs(before[0] - before[1]) / Math.max(1, Math.abs(after[0] - after[1])),
          from + ((to - from) * ((after[0] + after[1]) / 2 - left)) / width,
        );
    });
    for (const name of ["pointerup", "pointercancel"])
      over.addEventListener(name, ({ pointerId }) => fingers.delete(pointerId));
  }

  /** Show the time later by a share of what is shown. */
  pan(share) {
    const [from, to] = this.range();
    this.zoom = { min: from + (to - from) * share, max: to + (to - from) * share };
    this.isDirty = true;
  }

  /** Show more time by a factor, or less; a moment keeps its place, else the newest. */
  zoomBy(factor, at = this.range()[1]) {
    const [from, to] = this.range();
    const by = Math.min(10, Math.max(0.1, factor));
    this.zoom = { min: at - (at - from) * by, max: at + (to - at) * by };
    this.isDirty = true;
  }

  draw() {
    if (!this.isDirty || document.hidden) return;
    this.isDirty = false;
    this.liveButton.classList.toggle("unused", !this.zoom && !this.isPaused);
    if (this.chart) {
      const [from, to] = this.range();
      if (this.isOfBags) this.bags.show(from, to, this.chart.bbox.width / devicePixelRatio);
      if (this.over) {
        const over = this.series.get(this.over)?.samples ?? new Samples();
        const shown = this.visible();
        const data = shown.map(({ samples }) => pairs(over, samples, from, to, MAX_PAIRS));
        const scales = shown.map(({ label }) => this.axes.scaleOf(label));
        this.ranges = new Map(
          /** @type {[string, any][]} */ ([
            ["x", rangeOf(data.map(([xs]) => xs))],
            ...scales.map((scale) => [
              scale,
              rangeOf(data.filter((_, index) => scales[index] === scale).map(([, ys]) => ys)),
            ]),
          ]),
        );
        this.chart.setData([null, ...data]);
        this.showValues();
        return;
      }
      const data = drawn(
        this.visible().map((each) => each.samples),
        from,
        to,
        this.chart.bbox.width / devicePixelRatio,
        this.origin ?? 0,
      );
      this.chart.setData(data);
    }
    this.showValues();
  }

  showValues() {
    const at = this.over ? null : this.chart?.cursor.idx;
    let shown = 0;
    for (const series of this.series.values()) {
      let value = series.samples.last;
      if (!series.isHidden) {
        shown += 1;
        const ys = this.chart?.data[shown];
        if (at !== null && at !== undefined && ys) {
          let index = at;
          while (index > 0 && ys[index] === undefined) index--;
          value = ys[index] ?? null;
        }
      }
      setText(series.value, value === null || Number.isNaN(value) ? "–" : number(value));
      setText(series.count, t("{count} points", { count: series.samples.total }));
    }
  }

  clear() {
    for (const series of this.series.values()) {
      series.raw.drop(Infinity);
      series.raw.total = 0;
      this.setKind(series, series.kind);
    }
    this.origin = null;
    this.live();
  }

  saveCsv() {
    const all = [...this.series.values()].filter((each) => !each.isHidden);
    download(
      "plot.csv",
      new Blob(
        [
          csv(
            all.map(titleWithKind),
            all.map((each) => each.samples),
          ),
        ],
        { type: "text/csv" },
      ),
    );
  }

  savePng() {
    if (!this.chart) return;
    const source = this.chart.ctx.canvas;
    const scale = devicePixelRatio;
    const rows = this.visible();
    const canvas = h("canvas", { width: source.width, height: source.height + (rows.length * 20 + 16) * scale });
    const context = canvas.getContext("2d");
    const style = getComputedStyle(document.documentElement);
    context.fillStyle = style.getPropertyValue("--panel");
    context.fillRect(0, 0, canvas.width, canvas.height);
    context.drawImage(source, 0, 0);
    context.font = `${13 * scale}px system-ui, sans-serif`;
    const isMany = new Set(rows.map(({ label }) => this.axes.of(label))).size > 1;
    rows.forEach((each, row) => {
      const { label, color } = each;
      const title = titleWithKind(each);
      const y = source.height + (row * 20 + 16) * scale;
      context.fillStyle = color;
      context.fillRect(16 * scale, y - 9 * scale, 14 * scale, 9 * scale);
      context.fillStyle = style.getPropertyValue("--text");
      context.fillText(isMany ? `${title} (${titleOf(this.axes.of(label))})` : title, 38 * scale, y);
    });
    canvas.toBlob((blob) => download("plot.png", blob));
  }
}

/** Return what a file calls a series: its path, and what was computed of it. */
function titleWithKind({ label, kind }) {
  return kind ? `${label} ${kind}` : label;
}
