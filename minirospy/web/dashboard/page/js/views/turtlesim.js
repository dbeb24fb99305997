// The turtles of turtlesim on their paper: drawn from their poses, with the trails of their pens; spawn, kill, clear,
// reset, pens.

import { fill, h, number, setText, svg } from "../dom.js";
import { t } from "../texts.js";

const PIXELS = 500; // width and height of the paper, as in turtlesim
const METRE = 45; // pixels
const USUAL_BACKGROUND = [69, 86, 255];
const USUAL_PEN = { color: [179, 184, 255], width: 3, isOff: false };
const JUMP = 1; // metres between two poses; a longer way is a new turtle of the same name, or lost messages
const WIPED = 5; // colors of the bare paper under a turtle that rests on its trail

const css = (color) => `rgb(${color.join(" ")})`;
const isSame = (one, other) => one.every((value, index) => value === other[index]);

export class Turtlesim {
  constructor(link, words, main, place) {
    this.link = link;
    this.place = place;
    this.space = words.get("space"); // "" or the namespace of the simulator
    this.turtles = new Map();
    this.background = USUAL_BACKGROUND;
    this.paper = h("canvas", { class: "paper", width: PIXELS, height: PIXELS, "aria-hidden": "true" });
    this.context = this.paper.getContext("2d", { willReadFrequently: true });
    this.animals = svg("svg", {
      class: "animals",
      role: "img",
      "aria-label": "The turtles' paper",
      viewBox: `0 0 ${PIXELS} ${PIXELS}`,
      onclick: (event) => this.aim(event),
    });
    this.empty = h("p", { class: "empty" });
    this.choice = h("select", {
      "aria-label": "Simulator",
      hidden: true,
      onchange: () => this.choose(this.choice.value),
    });
    this.problem = h("p", { class: "error", role: "alert" });
    this.list = h("div", {});
    const input = (label, value, kind = "number") =>
      h("input", { type: kind, step: "any", value, "aria-label": label, placeholder: label });
    this.name = input("name", "", "text");
    this.place = { x: input("x", "2"), y: input("y", "2"), theta: input("theta", "0") };
    this.buttons = [
      h("button", { type: "button", onclick: () => this.wipe("clear") }, "Clear"),
      h("button", { type: "button", onclick: () => this.wipe("reset") }, "Reset"),
      h("button", { type: "submit", class: "primary" }, "Spawn"),
    ];
    main.append(
      h("div", { class: "bar" }, this.choice, this.buttons[0], this.buttons[1]),
      h(
        "div",
        { class: "split" },
        h("div", { class: "panel turtlesim" }, h("div", { class: "sheet" }, this.paper, this.animals, this.empty)),
        h(
          "div",
          { class: "panel side details turtles" },
          this.list,
          h(
            "form",
            {
              class: "spawn",
              onsubmit: (event) => {
                event.preventDefault();
                this.spawn();
              },
            },
            h("h3", {}, "New turtle"),
            this.name,
            Object.entries(this.place).map(([name, field]) => h("label", {}, h("span", { class: "key" }, name), field)),
            h("p", { class: "muted hint" }, "A click on the paper sets x and y."),
            this.buttons[2],
          ),
          this.problem,
        ),
      ),
    );
    this.erase();
    this.ending = link.watch(["channels", "services", "parameters", "state"], () => this.update());
  }

  close() {
    this.ending();
    for (const turtle of this.turtles.values()) turtle.end();
  }

  // --- what there is

  update() {
    const poses = [...this.link.channels.values()].filter(
      ({ type, topic }) => type === "turtlesim/Pose" && topic.endsWith("/pose"),
    );
    const spaces = [...this.link.services.values()]
      .filter(({ type }) => type === "turtlesim/Spawn")
      .map(({ name }) => name.slice(0, name.lastIndexOf("/")));
    if (spaces.join(" ") !== this.spaces) {
      this.spaces = spaces.join(" ");
      fill(
        this.choice,
        spaces.map((space) => h("option", { value: space }, space || "/")),
      );
    }
    this.choice.hidden = spaces.length < 2;
    const space = spaces.includes(this.space) ? this.space : (spaces[0] ?? "");
    this.choice.value = space;
    this.at = space;
    const names = new Set(
      poses.map(({ topic }) => topic.slice(0, -"/pose".length)).filter((name) => name.startsWith(`${space}/`)),
    );
    for (const [name, turtle] of [...this.turtles]) {
      if (names.has(name)) continue;
      turtle.end();
      turtle.shape.remove();
      turtle.row.remove();
      this.turtles.delete(name);
    }
    for (const name of names) if (!this.turtles.has(name)) this.add(name);
    for (const button of this.buttons) button.disabled = !spaces.length;
    for (const { name, row } of this.turtles.values()) {
      for (const button of row.querySelectorAll("button")) button.disabled = !this.link.services.has(`${name}/set_pen`);
    }
    const isDark = this.link.state === "open" && !this.turtles.size;
    setText(this.empty, isDark ? t("There is no turtle: start rosrun turtlesim turtlesim_node") : "");
    this.readBackground();
  }

  choose(space) {
    this.space = space;
    this.place.remember({ space });
    this.erase();
    this.update();
  }

  /**
   * Read the background from the simulator's parameters; it is that of the paper from the next clear on, and at first.
   */
  readBackground() {
    const key = [...this.link.parameters.keys()].find(
      (name) => name.startsWith(`${this.at}/`) && name.endsWith("/background_r"),
    );
    const stem = key?.slice(0, -1);
    const found = ["r", "g", "b"].map((part, index) => {
      const value = stem ? this.link.parameters.get(stem + part) : undefined;
      return Number.isInteger(value) ? value & 255 : USUAL_BACKGROUND[index];
    });
    if (isSame(found, this.wanted ?? [])) return;
    this.wanted = found;
    if (!this.isDrawn) this.erase();
  }

  erase() {
    this.background = this.wanted ?? USUAL_BACKGROUND;
    this.isDrawn = false;
    this.context.fillStyle = css(this.background);
    this.context.fillRect(0, 0, PIXELS, PIXELS);
  }

  // --- turtles

  add(name) {
    const shape = svg(
      "g",
      { class: "turtle" },
      [
        [12, -12],
        [12, 12],
        [-12, -12],
        [-12, 12],
      ].map(([cx, cy]) => svg("ellipse", { cx, cy, rx: 6, ry: 4 })),
      svg("path", { d: "M -16 0 L -24 -3 L -24 3 Z" }),
      svg("circle", { cx: 20, r: 7 }),
      svg("ellipse", { class: "shell", rx: 17, ry: 14 }),
      svg("title", {}, name),
    );
    shape.dataset.turtle = name;
    shape.style.display = "none";
    const turtle = { name, shape, pen: { ...USUAL_PEN }, pose: null, color: null, resting: 0, wasPainted: false };
    turtle.swatch = h("span", { class: "ink", title: "The color under the turtle" });
    turtle.text = h("span", { class: "mono" });
    const ink = h("input", { type: "color", value: "#b3b8ff", "aria-label": t("pen of {name}", { name }) });
    const width = h("input", {
      type: "number",
      min: 1,
      max: 255,
      value: "3",
      "aria-label": t("width of the pen of {name}", { name }),
    });
    const isOff = h("input", { type: "checkbox" });
    const pen = () =>
      this.setPen(
        turtle,
        [1, 3, 5].map((start) => parseInt(ink.value.slice(start, start + 2), 16)),
        Number(width.value),
        isOff.checked,
      );
    turtle.row = h(
      "div",
      { class: "turtle-row" },
      h(
        "div",
        { class: "bar" },
        turtle.swatch,
        h("strong", {}, name),
        h("a", { href: `#/teleop?topic=${encodeURIComponent(`${name}/cmd_vel`)}` }, t("drive")),
        h("button", { type: "button", class: "small", onclick: () => this.kill(turtle) }, t("kill")),
      ),
      turtle.text,
      h(
        "div",
        { class: "bar pen" },
        ink,
        width,
        h("label", {}, isOff, t("off")),
        h("button", { type: "button", class: "small", onclick: pen }, "set pen"),
      ),
    );
    turtle.row.dataset.name = name;
    const ends = [
      this.link.subscribe({ topic: `${name}/pose`, mode: "all" }, (item) => this.moved(turtle, item)),
      this.link.subscribe({ topic: `${name}/color_sensor`, mode: "all" }, (item) => this.sensed(turtle, item)),
    ];
    turtle.end = () => {
      for (const end of ends) end();
    };
    this.turtles.set(name, turtle);
    this.animals.append(shape);
    this.list.append(turtle.row);
  }

  moved(turtle, { lines = [], error }) {
    if (error) setText(this.problem, error);
    for (const { message } of lines) this.draw(turtle, message);
    const { pose, shape } = turtle;
    if (!pose) return;
    shape.style.display = "";
    shape.setAttribute(
      "transform",
      `translate(${pose.x * METRE} ${PIXELS - 1 - pose.y * METRE}) rotate(${(-pose.theta * 180) / Math.PI})`,
    );
    setText(
      turtle.text,
      `x ${number(Number(pose.x.toFixed(3)))} y ${number(Number(pose.y.toFixed(3)))} θ ${number(Number(pose.theta.toFixed(3)))}`,
    );
  }

  draw(turtle, pose) {
    const from = turtle.pose;
    turtle.pose = pose;
    if (!from || (from.x === pose.x && from.y === pose.y)) return;
    turtle.resting = 0;
    turtle.wasPainted = false;
    if (turtle.pen.isOff || Math.hypot(pose.x - from.x, pose.y - from.y) > JUMP) return;
    // The sensor shows the pen where the turtle is slow, as it is over its fresh line.
    const isPainted = turtle.color && !isSame(turtle.color, this.background);
    const { context } = this;
    context.strokeStyle = css(isPainted ? turtle.color : turtle.pen.color);
    context.lineWidth = turtle.pen.width;
    context.lineCap = "round";
    context.beginPath();
    context.moveTo(from.x * METRE, PIXELS - 1 - from.y * METRE);
    context.lineTo(pose.x * METRE, PIXELS - 1 - pose.y * METRE);
    context.stroke();
    this.isDrawn = true;
  }

  sensed(turtle, { lines = [] }) {
    for (const { message } of lines) {
      turtle.color = [message.r, message.g, message.b];
      const isBare = isSame(turtle.color, this.wanted ?? USUAL_BACKGROUND);
      turtle.resting = isBare ? turtle.resting + 1 : 0;
      if (!isBare) turtle.wasPainted = true;
      // Its trail is gone from under it while it rests: another program has cleared the paper.
      if (turtle.wasPainted && turtle.resting === WIPED) {
        turtle.wasPainted = false;
        this.erase();
      }
    }
    if (turtle.color) turtle.swatch.style.background = css(turtle.color);
  }

  // --- services

  async call(service, request) {
    setText(this.problem, "");
    try {
      await this.link.call(service, request);
      return true;
    } catch (error) {
      setText(this.problem, error.message);
      return false;
    }
  }

  async wipe(name) {
    if (!(await this.call(`${this.at}/${name}`, {}))) return;
    for (const turtle of this.turtles.values()) {
      turtle.wasPainted = false;
      if (name === "reset") Object.assign(turtle, { pose: null, pen: { ...USUAL_PEN } });
    }
    this.erase();
  }

  spawn() {
    const place = Object.fromEntries(Object.entries(this.place).map(([name, field]) => [name, Number(field.value)]));
    return this.call(`${this.at}/spawn`, { ...place, name: this.name.value.trim() });
  }

  kill({ name }) {
    return this.call(`${this.at}/kill`, { name: name.slice(this.at.length + 1) });
  }

  async setPen(turtle, color, width, isOff) {
    const [r, g, b] = color;
    if (await this.call(`${turtle.name}/set_pen`, { r, g, b, width, off: isOff ? 1 : 0 }))
      Object.assign(turtle, { pen: { color, width, isOff }, color: null });
  }

  aim(event) {
    const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(this.animals.getScreenCTM().inverse());
    this.place.x.value = (point.x / METRE).toFixed(2);
    this.place.y.value = ((PIXELS - 1 - point.y) / METRE).toFixed(2);
  }
}
