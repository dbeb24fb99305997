// Driving: a stick on the screen, keys, a gamepad -> geometry_msgs/Twist, and a gamepad -> sensor_msgs/Joy. The server
// publishes them,
// and zero if nothing is held any more, or the page is lost.

import { fill, h, setText, svg, uniqueId } from "../dom.js";
import { Drive } from "../drive.js";
import { joyOf } from "../joy.js";
import { t } from "../texts.js";

const TYPE = "geometry_msgs/Twist";
const PERIOD_MS = 50;
const RADIUS = 100; // of the stick's way
const DEAD_ZONE = 0.1; // of a gamepad's stick
const DEADMAN = [4, 5]; // the gamepad's shoulder buttons
const KEYS = {
  ArrowUp: [1, 0],
  KeyW: [1, 0],
  ArrowDown: [-1, 0],
  KeyS: [-1, 0],
  ArrowLeft: [0, 1],
  KeyA: [0, 1],
  ArrowRight: [0, -1],
  KeyD: [0, -1],
};

const isText = (element) => /INPUT|SELECT|TEXTAREA/.test(element?.tagName ?? "");

export class Teleop {
  constructor(link, words, main, place) {
    this.link = link;
    this.place = place;
    this.topic = words.get("topic") || "/cmd_vel";
    this.keys = new Set();
    this.stick = null; // [forward, left] of -1 to 1 while it is held
    this.isDriving = false;
    this.joyTopic = words.get("joy") ?? "";
    this.hasJoy = false; // whether a joystick's state was sent that may not be at rest
    this.drive = new Drive(link, (fields) => this.answered(fields));
    const field = (label, value, attributes) =>
      h("input", { "aria-label": label, value, autocomplete: "off", ...attributes });
    this.where = field("Topic", this.topic, {
      type: "text",
      class: "grow",
      onchange: () => this.choose(this.where.value.trim()),
    });
    this.topics = h("datalist", { id: uniqueId("twists") });
    this.where.setAttribute("list", this.topics.id);
    const speed = (label, name, usual) =>
      field(label, words.get(name) || usual, { type: "number", min: 0, step: "any", onchange: () => this.remember() });
    this.forward = speed("Metres a second", "linear", "0.5");
    this.turn = speed("Radians a second", "angular", "1");
    this.joy = h("input", { type: "checkbox", checked: Boolean(this.joyTopic), onchange: () => this.switchJoy() });
    this.knob = svg("circle", { class: "knob", r: 38 });
    this.pad = svg(
      "svg",
      {
        class: "stick",
        viewBox: "-150 -150 300 300",
        tabindex: 0,
        role: "application",
        "aria-label": "Stick: up is forward",
      },
      svg("circle", { class: "way", r: 138 }),
      svg("path", { class: "cross", d: "M 0 -130 V 130 M -130 0 H 130" }),
      this.knob,
    );
    this.pad.addEventListener("pointerdown", (event) => {
      this.pad.setPointerCapture(event.pointerId);
      this.pointer = event.pointerId;
      this.pull(event);
    });
    this.pad.addEventListener("pointermove", (event) => {
      if (this.pointer === event.pointerId) this.pull(event);
    });
    for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) {
      this.pad.addEventListener(name, (event) => {
        if (this.pointer === event.pointerId) this.letGo();
      });
    }
    this.values = h("p", { class: "mono", role: "status" }, t("stopped"));
    this.device = h("p", { class: "muted hint" });
    this.problem = h("p", { class: "error", role: "alert" });
    main.append(
      h(
        "div",
        { class: "bar" },
        this.where,
        this.topics,
        h("label", {}, this.forward, "m/s"),
        h("label", {}, this.turn, "rad/s"),
        h("button", { type: "button", class: "stop", onclick: () => this.release(true) }, "Stop"),
      ),
      h(
        "div",
        { class: "panel teleop" },
        this.pad,
        this.values,
        h(
          "p",
          { class: "muted hint" },
          "Hold the stick, or the arrow keys or W A S D. With a gamepad hold a shoulder button and push its left stick.",
        ),
        this.device,
        h("label", { class: "muted hint" }, this.joy, "publish the gamepad as /joy"),
        this.problem,
      ),
    );
    this.ends = [link.watch(["channels", "graph", "state"], () => this.update())];
    this.listen(window, "keydown", (event) => this.key(event));
    this.listen(window, "keyup", (event) => this.key(event));
    for (const name of ["blur", "pagehide"]) this.listen(window, name, () => this.release());
    this.listen(document, "visibilitychange", () => {
      if (document.hidden) this.release();
    });
    for (const name of ["gamepadconnected", "gamepaddisconnected"]) this.listen(window, name, () => this.tick());
    this.timer = setInterval(() => this.tick(), PERIOD_MS);
  }

  listen(target, name, react) {
    target.addEventListener(name, react);
    this.ends.push(() => target.removeEventListener(name, react));
  }

  close() {
    clearInterval(this.timer);
    this.release();
    for (const end of this.ends) end();
    this.drive.close();
  }

  update() {
    const { channels, graph, state, mayWrite } = this.link;
    const typed = [...channels.values()].filter(({ type }) => type === TYPE).map(({ topic }) => topic);
    // A topic that is only subscribed has no channel yet, and no type here: its name says enough.
    const waiting = [...graph.subscribed.keys()].filter((topic) => topic.endsWith("cmd_vel"));
    fill(
      this.topics,
      [...new Set([...typed, ...waiting])].sort().map((topic) => h("option", { value: topic })),
    );
    if (state !== "open") this.drop();
    else {
      const other = channels.get(this.topic);
      setText(
        this.problem,
        !mayWrite
          ? t("This token is read-only: it drives nothing.")
          : other && other.type !== TYPE
            ? t("{topic} has the type {type}, not {wanted}", { topic: this.topic, type: other.type, wanted: TYPE })
            : "",
      );
    }
  }

  choose(topic) {
    this.release();
    this.drive.send({ leave: this.topic });
    this.topic = topic.startsWith("/") ? topic : `/${topic}`;
    this.where.value = this.topic;
    this.remember();
    this.update();
  }

  remember() {
    this.place.remember({
      topic: this.topic,
      linear: this.forward.value,
      angular: this.turn.value,
      joy: this.joyTopic,
    });
  }

  // --- what is held

  pull(event) {
    const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(this.pad.getScreenCTM().inverse());
    const scale = Math.min(1, RADIUS / Math.hypot(point.x, point.y)) / RADIUS;
    this.stick = [-point.y * scale || 0, -point.x * scale || 0];
    this.tick();
  }

  letGo() {
    this.pointer = null;
    this.stick = null;
    this.tick();
  }

  key(event) {
    if (!Object.hasOwn(KEYS, event.code) || event.ctrlKey || event.altKey || event.metaKey) return;
    if (event.type === "keydown") {
      if (isText(document.activeElement) || !this.place.isActive()) return;
      event.preventDefault();
      this.keys.add(event.code);
    } else if (!this.keys.delete(event.code)) return;
    this.tick();
  }

  /** Return [forward, left] of a gamepad whose deadman button is held, or null. */
  gamepad() {
    const pads = [...(navigator.getGamepads?.() ?? [])].filter((pad) => pad?.connected);
    setText(this.device, pads.length ? `${t("Gamepad:")} ${pads[0].id}` : "");
    if (!this.place.isActive()) return null;
    const pad = pads.find(({ buttons }) => DEADMAN.some((index) => buttons[index]?.pressed));
    if (!pad) return null;
    return [1, 0].map((axis) => (Math.abs(pad.axes[axis] ?? 0) < DEAD_ZONE ? 0 : -pad.axes[axis]));
  }

  held() {
    const pad = this.gamepad();
    if (this.stick) return this.stick;
    if (!this.keys.size) return pad;
    const sums = [0, 0];
    for (const code of this.keys)
      KEYS[code].forEach((value, index) => {
        sums[index] += value;
      });
    return sums.map((value) => Math.max(-1, Math.min(1, value)));
  }

  // --- a gamepad as it is

  switchJoy() {
    if (!this.joy.checked) this.restJoy();
    this.joyTopic = this.joy.checked ? "/joy" : "";
    this.remember();
  }

  sendJoy() {
    if (!this.joyTopic || !this.place.isActive()) return this.restJoy();
    const pad = [...(navigator.getGamepads?.() ?? [])].find((each) => each?.connected);
    if (!pad) return this.restJoy();
    this.hasJoy = true;
    return this.drive.send({ topic: this.joyTopic, ...joyOf(pad) });
  }

  /** Let the joystick be at rest: the server publishes that. */
  restJoy() {
    if (this.hasJoy) this.drive.send({ leave: this.joyTopic });
    this.hasJoy = false;
  }

  // --- what is sent

  tick() {
    if (!this.drive.isOpen || !this.link.mayWrite || document.hidden) return;
    this.sendJoy();
    const held = this.held();
    if (held) this.push(held);
    else if (this.isDriving) this.release();
  }

  /** @param {number[]} velocity */
  push([forward, left]) {
    this.isDriving = true;
    const linear = forward * (Number(this.forward.value) || 0);
    const angular = left * (Number(this.turn.value) || 0);
    this.knob.setAttribute("transform", `translate(${-left * RADIUS} ${-forward * RADIUS})`);
    setText(this.values, `${linear.toFixed(2)} m/s, ${angular.toFixed(2)} rad/s`);
    this.send(linear, angular);
  }

  /** Let go of everything, and stop what was driven; isAlways: also what this page has not driven. */
  release(isAlways = false) {
    const wasDriving = this.isDriving || isAlways;
    this.drop();
    this.restJoy();
    if (wasDriving && this.link.mayWrite) this.send(0, 0);
  }

  drop() {
    this.keys.clear();
    this.stick = null;
    this.pointer = null;
    this.isDriving = false;
    this.knob.removeAttribute("transform");
    setText(this.values, t("stopped"));
  }

  send(linear, angular) {
    this.drive.send({ topic: this.topic, twist: [linear, 0, 0, 0, 0, angular] });
  }

  answered({ lost, error, stopped }) {
    if (lost) {
      this.hasJoy = false;
      this.drop();
    }
    if (error) setText(this.problem, error);
    if (stopped) setText(this.values, t("stopped by the server: this page was silent"));
  }
}
