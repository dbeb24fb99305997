// The y axes of a plot: their labels, ranges and sides; the fields, the wheel and the drags that change them.

import { h, number } from "./dom.js";
import { t } from "./texts.js";
import { STEPS, tickTexts } from "./ticks.js";

export const MAX_AXES = 6;
const LEAST_SIZE = 40; // pixels for the numbers of an axis
const FONT = "12px system-ui";

const isLeft = (axis) => axis % 2 === 1;
export const titleOf = (axis) => t(isLeft(axis) ? "axis {axis}, left" : "axis {axis}, right", { axis });

/** Return [axis, rest] of words such as "2 /path/y" for an axis that there may be, else null. */
function numbered(text) {
  const found = /^([1-9]) (.+)$/.exec(text);
  return found && Number(found[1]) <= MAX_AXES ? [Number(found[1]), found[2]] : null;
}

/** Return a limit of a range: a number, or null if it follows the values. */
const limitOf = (text) => (text.trim() && Number.isFinite(Number(text)) ? Number(text) : null);

export class Axes {
  /** ``words`` are those of the address; ``changed`` is called with true if the chart is to be built again. */
  constructor(words, changed) {
    this.changed = changed;
    const all = (name) => words.getAll(name).map(numbered).filter(Boolean);
    this.labels = new Map(all("label")); // axis -> text
    this.ranges = new Map(); // axis -> [low, high], null if it follows the values
    for (const [axis, text] of all("range")) this.setRange(axis, ...text.split(" ", 2).map(limitOf));
    // label of a series -> axis, but the first
    this.chosen = new Map(all("axis").map(([axis, label]) => [label, axis]));
    this.rows = new Map(); // axis -> its row of the table
    this.element = h("div", { class: "axes panel", role: "group", "aria-label": "Y axes", hidden: true });
    this.button = h(
      "button",
      {
        type: "button",
        "aria-expanded": "false",
        onclick: () => {
          this.element.hidden = !this.element.hidden;
          this.button.setAttribute("aria-expanded", String(!this.element.hidden));
        },
      },
      "Y axes",
    );
    this.autoButton = h(
      "button",
      {
        type: "button",
        class: "primary keeps-place",
        title: "All y axes follow their values again",
        onclick: () => {
          this.ranges.clear();
          this.showRanges();
          this.changed(false);
        },
      },
      "Auto range",
    );
    this.showRanges();
  }

  /** Return what the address keeps. */
  words() {
    return [
      ...[...this.chosen].map(([label, axis]) => ["axis", `${axis} ${label}`]),
      ...[...this.labels].map(([axis, text]) => ["label", `${axis} ${text}`]),
      ...[...this.ranges].map(([axis, range]) => [
        "range",
        `${axis} ${range.map((each) => (each === null ? "auto" : number(each))).join(" ")}`,
      ]),
    ];
  }

  /** Return the axis of a series. */
  of(label) {
    return this.chosen.get(label) ?? 1;
  }

  /** Return the choice of an axis for a series. */
  choice({ label }) {
    const choice = h(
      "select",
      {
        class: "small",
        "aria-label": t("Axis of {label}", { label }),
        onchange: () => {
          this.choose(label, Number(choice.value));
          this.changed(true);
        },
      },
      Array.from({ length: MAX_AXES }, (_, index) => h("option", { value: index + 1 }, titleOf(index + 1))),
    );
    choice.value = this.of(label);
    return choice;
  }

  choose(label, axis) {
    if (axis > 1) this.chosen.set(label, axis);
    else this.chosen.delete(label);
  }

  setRange(axis, low = null, high = null) {
    if (low !== null && high !== null && low > high) [low, high] = [high, low];
    if ((low === null && high === null) || low === high) this.ranges.delete(axis);
    else this.ranges.set(axis, [low, high]);
  }

  /** Return the name of a series' scale in uPlot. */
  scaleOf(label) {
    return `y${this.of(label)}`;
  }

  /** Return the range of a series' axis, whose values have this one. */
  rangeOf(label, auto) {
    const [low, high] = this.ranges.get(this.of(label)) ?? [null, null];
    const found = [low ?? auto[0], high ?? auto[1]];
    if (found[0] < found[1]) return found;
    // All values are beyond the one limit that is set.
    return low === null ? [high - 1, high] : [low, low + 1];
  }

  /** Return uPlot's axes of these series; ``style`` returns one of what it has besides. */
  drawn(series, style) {
    const used = [...new Set(series.map(({ label }) => this.of(label)))].sort();
    this.showRows(used);
    return used.map((axis, index) => {
      const own = series.filter((each) => this.of(each.label) === axis);
      const label = this.labels.get(axis);
      return style({
        scale: `y${axis}`,
        side: isLeft(axis) ? 3 : 1,
        size: (...words) => this.size(...words),
        incrs: STEPS,
        values: (chart, all, index, space, step) => tickTexts(all, step),
        ...(index ? { grid: { show: false } } : {}),
        ...(used.length > 1 && own.length === 1 ? { stroke: own[0].color } : {}),
        ...(label ? { label, labelSize: 20, labelGap: 0, labelFont: FONT } : {}),
      });
    });
  }

  /** Return the width that the numbers of an axis need, in steps: it is not another one with each digit. */
  size(chart, values, index, cycle) {
    const axis = chart.axes[index];
    if (cycle > 1) return axis.width;
    chart.ctx.font = FONT;
    const longest = Math.max(0, ...(values ?? []).map((each) => chart.ctx.measureText(each).width));
    axis.width = Math.max(LEAST_SIZE, Math.ceil((longest + 18) / 8) * 8);
    return axis.width;
  }

  /**
   * Let the wheel and drags over the numbers of a chart's axes zoom and pan them; a double click lets them follow their
   * values.
   */
  attach(chart) {
    const elements = chart.root.querySelectorAll(".u-axis");
    chart.axes.forEach(({ scale }, index) => {
      if (scale === "x") return;
      const element = elements[index];
      const axis = Number(scale.slice(1));
      const set = (low, high) => {
        this.setRange(axis, low, high);
        this.showRanges();
        this.changed(false);
      };
      element.classList.add("scaled");
      element.title = t("wheel: zoom · drag: pan · double click: follow the values");
      element.addEventListener("dblclick", () => set(null, null));
      element.addEventListener(
        "wheel",
        (event) => {
          event.preventDefault();
          event.stopPropagation();
          const { min, max } = chart.scales[scale];
          const by = event.deltaX || (event.shiftKey ? event.deltaY : 0);
          const at = by
            ? (max - min) * 0.0015 * by
            : chart.posToVal(event.clientY - chart.over.getBoundingClientRect().top, scale);
          const factor = Math.min(10, Math.max(0.1, Math.exp(event.deltaY * 0.002)));
          if (by) set(min + at, max + at);
          else set(at - (at - min) * factor, at + (max - at) * factor);
        },
        { passive: false },
      );
      element.addEventListener("pointerdown", (event) => {
        if (event.button) return;
        const { min, max } = chart.scales[scale];
        const move = ({ clientY }) => {
          const by = ((clientY - event.clientY) / chart.over.clientHeight) * (max - min);
          if (by) set(min + by, max + by);
        };
        element.setPointerCapture(event.pointerId);
        element.addEventListener("pointermove", move);
        element.addEventListener("lostpointercapture", () => element.removeEventListener("pointermove", move), {
          once: true,
        });
      });
    });
  }

  /** Show a row of fields for each axis that is used. */
  showRows(used) {
    if (used.join() === [...this.rows.keys()].join()) return;
    this.rows.clear();
    for (const axis of used) {
      const title = titleOf(axis);
      const limit = (spoken) =>
        h("input", {
          inputmode: "decimal",
          size: 7,
          placeholder: "auto",
          "aria-label": spoken,
          autocomplete: "off",
          onchange: () => {
            this.setRange(axis, ...limits.map(({ value }) => limitOf(value.replace(",", "."))));
            this.showRanges();
            this.changed(false);
          },
        });
      const limits = [limit(t("{title}: from", { title })), limit(t("{title}: to", { title }))];
      const label = h("input", {
        placeholder: "label, unit",
        "aria-label": t("{title}: label, unit", { title }),
        autocomplete: "off",
        maxlength: 60,
        onchange: () => {
          if (label.value.trim()) this.labels.set(axis, label.value.trim());
          else this.labels.delete(axis);
          this.changed(true);
        },
      });
      label.value = this.labels.get(axis) ?? "";
      const row = h(
        "div",
        { class: "bar" },
        h("span", { class: "axis" }, title),
        label,
        h("label", {}, t("from"), limits[0]),
        h("label", {}, t("to"), limits[1]),
      );
      this.rows.set(axis, { row, limits });
    }
    this.element.replaceChildren(...[...this.rows.values()].map(({ row }) => row));
    this.showRanges();
  }

  showRanges() {
    for (const [axis, { limits }] of this.rows) {
      const range = this.ranges.get(axis) ?? [null, null];
      limits.forEach((input, index) => {
        input.value = range[index] === null ? "" : number(range[index]);
      });
    }
    this.autoButton.classList.toggle("unused", !this.ranges.size);
  }
}
