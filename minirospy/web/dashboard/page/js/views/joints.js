// The joints of robot_description: a slider for each that can be set; the server publishes joint_states, as
// joint_state_publisher_gui.

import { h, setText } from "../dom.js";
import { Endpoint } from "../endpoint.js";
import { t } from "../texts.js";

const PROTOCOL = "minirospy.joints.v1";
const STEPS = 1000;
const DEGREES = 180 / Math.PI;
const QUIET_MS = 400; // after a slider was moved here, the server's answer to older moves is ignored

export class Joints {
  constructor(link, words, main, place) {
    this.rows = new Map();
    this.joints = null;
    this.waiting = null;
    this.filter = h("input", {
      type: "search",
      placeholder: "Filter joints",
      "aria-label": "Filter joints",
      oninput: () => this.showFiltered(),
    });
    this.inDegrees = h("input", {
      type: "checkbox",
      checked: words.get("degrees") === "1",
      onchange: () => {
        place.remember(this.inDegrees.checked ? { degrees: "1" } : {});
        for (const row of this.rows.values()) this.showRow(row);
      },
    });
    const button = (text, op, title) =>
      h("button", { type: "button", title, onclick: () => this.endpoint.send({ op }) }, text);
    this.buttons = [
      button("Center", "center", "All joints to their zeros"),
      button("Randomize", "randomize", "All joints anywhere between their limits"),
    ];
    this.publishing = h("input", {
      type: "checkbox",
      onchange: () => this.endpoint.send({ op: "publish", on: this.publishing.checked }),
    });
    this.publishLabel = h(
      "label",
      { class: "publish-switch" },
      this.publishing,
      (this.publishText = h("span", {}, t("Publish"))),
    );
    this.problem = h("p", { class: "error", role: "alert" });
    this.warning = h("p", { class: "joint-warning" });
    this.about = h("p", { class: "muted" });
    this.list = h("div", { class: "panel joints" });
    this.empty = h("p", { class: "empty" });
    main.append(
      h(
        "div",
        { class: "bar" },
        this.filter,
        h("label", {}, this.inDegrees, t("degrees")),
        this.buttons,
        this.publishLabel,
        h(
          "button",
          {
            type: "button",
            title: "Read robot_description again",
            "aria-label": "Read robot_description again",
            onclick: () => this.endpoint.send({ op: "reload" }),
          },
          "↻",
        ),
      ),
      this.problem,
      this.warning,
      this.list,
      this.about,
      this.empty,
    );
    this.endpoint = new Endpoint(link, PROTOCOL, {
      writes: (writes) => {
        this.writes = writes;
        setText(this.problem, writes ? "" : t("This token is read-only: it sets no joints."));
        this.enable();
      },
      joints: (joints, { why }) => this.show(joints, why),
      state: (state) => this.follow(state),
      error: (text) => setText(this.problem, text),
    });
    this.enable();
  }

  close() {
    clearTimeout(this.waiting);
    clearTimeout(this.later);
    this.endpoint.close();
  }

  enable() {
    const isOff = !this.joints || !this.writes;
    for (const button of this.buttons) button.disabled = isOff;
    this.publishing.disabled = isOff || Boolean(this.joints?.always);
    for (const row of this.rows.values())
      if (row.slider) row.slider.disabled = row.input.disabled = row.zero.disabled = isOff;
  }

  show(joints, why) {
    this.joints = joints;
    this.rows.clear();
    this.list.replaceChildren();
    for (const [name, kind, limits] of joints?.rows ?? []) {
      const row = limits ? this.makeRow(name, kind, limits) : this.makeFollower(name, kind);
      this.rows.set(name, row);
      this.list.append(row.element);
    }
    this.list.hidden = !this.rows.size;
    setText(this.empty, joints ? (this.rows.size ? "" : t("This robot has no joint that can be set.")) : t(why));
    setText(
      this.about,
      joints
        ? [
            joints.robot,
            t("{topic} at {rate} Hz while it is published", { topic: joints.topic, rate: joints.rate }),
            joints.sources.length ? t("follows {sources}", { sources: joints.sources.join(", ") }) : "",
            ...joints.warnings,
          ]
            .filter(Boolean)
            .join(" · ")
        : "",
    );
    setText(this.publishText, joints ? t("Publish {topic}", { topic: joints.topic }) : t("Publish"));
    this.enable();
    this.showFiltered();
    if (this.state) this.follow(this.state);
  }

  makeRow(name, kind, [lower, upper, zero]) {
    const row = { name, kind, lower, upper, position: zero, changed: -Infinity };
    const set = (position) => {
      row.position = Math.min(upper, Math.max(lower, position));
      row.changed = performance.now();
      this.showRow(row);
      this.changed();
    };
    row.slider = h("input", {
      type: "range",
      min: 0,
      max: STEPS,
      step: "any",
      "aria-label": name,
      oninput: () => set(lower + (row.slider.value / STEPS) * (upper - lower)),
    });
    row.slider.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageUp: 10, PageDown: -10 }[event.key];
      if (!step) return;
      event.preventDefault();
      set(row.position + (step * (upper - lower)) / 100);
    });
    row.input = h("input", {
      type: "number",
      step: "any",
      "aria-label": t("position of {name}", { name }),
      onchange: () => {
        const value = Number(row.input.value);
        if (row.input.value !== "" && Number.isFinite(value)) set(value / this.factor(row));
        else this.showRow(row);
      },
    });
    row.input.addEventListener("blur", () => this.showRow(row, true));
    row.zero = h("button", { type: "button", class: "small", title: "To its zero", onclick: () => set(zero) }, "0");
    row.low = h("span", { class: "num muted" });
    row.high = h("span", { class: "num muted high" });
    row.unit = h("span", { class: "muted" });
    row.element = h(
      "div",
      { class: "joint" },
      h("span", { class: "name" }, name),
      h("span", { class: "muted joint-kind" }, kind),
      row.low,
      row.slider,
      row.high,
      row.input,
      row.unit,
      row.zero,
    );
    row.element.dataset.joint = name;
    this.showRow(row);
    return row;
  }

  // A joint that mimics another one.
  makeFollower(name, kind) {
    const row = {
      name,
      kind,
      slider: null,
      position: 0,
      value: h("span", { class: "num joint-value" }),
      unit: h("span", { class: "muted" }),
    };
    row.element = h(
      "div",
      { class: "joint follower" },
      h("span", { class: "name" }, name),
      h("span", { class: "muted joint-kind" }, kind),
      h("span", { class: "muted joint-follows" }, t("follows another joint")),
      row.value,
      row.unit,
    );
    row.element.dataset.joint = name;
    return row;
  }

  factor({ kind }) {
    return this.inDegrees.checked && kind !== "prismatic" ? DEGREES : 1;
  }

  showRow(row, isLeft = false) {
    const factor = this.factor(row);
    const shown = (value) => String(Number((value * factor).toFixed(factor === 1 ? 3 : 1)));
    setText(row.unit, row.kind === "prismatic" ? "m" : factor === 1 ? "rad" : "°");
    if (!row.slider) {
      setText(row.value, shown(row.position));
      return;
    }
    const { lower, upper, position } = row;
    const share = upper > lower ? ((position - lower) / (upper - lower)) * STEPS : STEPS / 2;
    row.slider.value = String(share);
    row.slider.setAttribute("aria-valuetext", `${shown(position)} ${row.unit.textContent}`);
    setText(row.low, shown(lower));
    setText(row.high, shown(upper));
    if (isLeft || document.activeElement !== row.input) row.input.value = shown(position);
  }

  /** Send what was moved, a few times a second. */
  changed() {
    this.waiting ??= setTimeout(() => {
      this.waiting = null;
      const positions = Object.fromEntries(
        [...this.rows.values()]
          .filter((row) => row.slider && row.changed > (this.sent ?? -Infinity))
          .map(({ name, position }) => [name, position]),
      );
      this.sent = performance.now();
      this.endpoint.send({ op: "set", positions });
    }, 30);
  }

  follow(state) {
    this.state = state;
    this.publishing.checked = state.publishing;
    this.publishLabel.classList.toggle("on", state.publishing);
    setText(
      this.warning,
      state.others.length
        ? t(
            state.others.length > 1
              ? "{names} publish {topic}, too: the robot jumps between both."
              : "{names} publishes {topic}, too: the robot jumps between both.",
            { names: state.others.join(", "), topic: this.joints?.topic ?? t("joint states") },
          )
        : "",
    );
    this.warning.hidden = !state.others.length || !state.publishing;
    const now = performance.now();
    let isLeft = false;
    for (const [name, position] of Object.entries(state.positions)) {
      const row = this.rows.get(name);
      if (!row) continue;
      if (now - (row.changed ?? -Infinity) < QUIET_MS) {
        isLeft = true;
        continue;
      }
      row.position = position ?? NaN;
      this.showRow(row);
    }
    clearTimeout(this.later);
    if (isLeft) this.later = setTimeout(() => this.follow(this.state), QUIET_MS);
  }

  showFiltered() {
    const words = this.filter.value.toLowerCase().split(/\s+/);
    for (const { name, element } of this.rows.values())
      element.hidden = !words.every((word) => name.toLowerCase().includes(word));
  }
}
