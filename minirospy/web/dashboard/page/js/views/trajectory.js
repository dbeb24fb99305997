// Joints of a JointTrajectoryController, moved by sliders, as rqt_joint_trajectory_controller. The server publishes
// what is sent here, and lets the controller hold its joints if this page turns off, is lost, or is silent.

import { descriptionOf, jointsOf, limitsOf, namespaceOf, secondsOf, takesTrajectories } from "../control.js";
import { fill, h, setText } from "../dom.js";
import { Drive } from "../drive.js";
import { errorText, t } from "../texts.js";
import { ControllerLister, ManagerChoice, showChoices } from "./controllers.js";

const PERIOD_MS = 100;
const STEPS = 1000;
const USUAL_SPEED = 50; // percent of the joints' highest velocities

export class Trajectory {
  constructor(link, words, main, place) {
    this.link = link;
    this.place = place;
    this.controllers = [];
    this.name = words.get("controller") ?? "";
    this.topic = ""; // of the commands to the chosen controller, if it runs
    this.rows = new Map();
    this.isOn = false;
    this.endState = () => {};
    this.drive = new Drive(link, (fields) => this.answered(fields));
    this.pick = h("select", {
      class: "grow",
      "aria-label": "Controller",
      onchange: () => this.choose(this.pick.value),
    });
    this.speed = h("input", {
      type: "number",
      min: 1,
      max: 100,
      value: words.get("speed") || String(USUAL_SPEED),
      "aria-label": "Speed in percent of the joints' highest velocities",
      onchange: () => this.remember(),
    });
    this.switch = h("input", { type: "checkbox", onchange: () => this.turn(this.switch.checked) });
    this.switchLabel = h("label", { class: "publish-switch" }, this.switch, h("span", {}, t("Send commands")));
    this.problem = h("p", { class: "error", role: "alert" });
    this.list = h("div", { class: "panel joints" });
    this.empty = h("p", { class: "empty" });
    this.lister = new ControllerLister(
      link,
      (controllers) => {
        this.controllers = controllers.filter((each) => takesTrajectories(each) && each.state === "running");
        this.showControllers();
      },
      (text) => setText(this.problem, text),
    );
    this.choice = new ManagerChoice(link, words.get("manager") ?? "", (manager) => this.follow(manager));
    main.append(
      h(
        "div",
        { class: "bar" },
        this.choice.element,
        this.pick,
        h("label", {}, t("Speed"), this.speed, "%"),
        this.switchLabel,
      ),
      this.problem,
      this.list,
      this.empty,
    );
    if (this.choice.manager) this.follow(this.choice.manager);
    this.ends = [
      link.watch(["services", "state", "parameters"], () => {
        if (!this.choice.isThere) this.controllers = [];
        else if (!this.controllers.length) this.lister.ask();
        this.showControllers();
      }),
    ];
    const listen = (target, name, react) => {
      target.addEventListener(name, react);
      this.ends.push(() => target.removeEventListener(name, react));
    };
    listen(window, "pagehide", () => this.turn(false));
    listen(document, "visibilitychange", () => {
      if (document.hidden) this.turn(false);
    });
    this.timer = setInterval(() => this.tick(), PERIOD_MS);
  }

  close() {
    clearInterval(this.timer);
    this.turn(false);
    this.lister.close();
    this.choice.end();
    this.endState();
    for (const end of this.ends) end();
    this.drive.close();
  }

  remember() {
    this.place.remember({ manager: this.choice.manager, controller: this.name, speed: this.speed.value });
  }

  // --- which controller

  follow(manager) {
    if (!this.choice) return; // chosen while it is made
    this.controllers = [];
    this.remember();
    this.lister.follow(manager);
    this.showControllers();
  }

  choose(name) {
    this.name = name;
    this.remember();
    this.showControllers();
  }

  showControllers() {
    const names = this.controllers.map(({ name }) => name).sort();
    // One that does not run now stays chosen.
    if (!this.name && names.length) this.name = names[0];
    showChoices(this.pick, names, this.name, t("no controller"));
    const controller = this.controllers.find(({ name }) => name === this.name);
    const description = descriptionOf(namespaceOf(this.choice.manager), this.link.parameters);
    const drawn = JSON.stringify([this.choice.manager, controller, description]);
    if (drawn !== this.drawn) {
      this.drawn = drawn;
      this.open(controller, description);
    }
    setText(
      this.empty,
      this.rows.size || this.link.state !== "open"
        ? ""
        : !this.link.mayWrite
          ? t("This token is read-only: it moves nothing.")
          : !this.choice.isThere
            ? t("No controller manager runs: a node that has one offers the service list_controllers.")
            : this.name
              ? t("{name} does not run.", { name: this.name })
              : t("No JointTrajectoryController runs."),
    );
  }

  /** Show the sliders of a controller, with the limits in a description of the robot. */
  open(controller, description) {
    this.turn(false);
    this.endState();
    this.endState = () => {};
    this.topic = "";
    this.rows.clear();
    fill(this.list);
    this.list.hidden = !controller;
    setText(this.problem, "");
    if (!controller) {
      this.enable();
      return;
    }
    let limits = new Map();
    try {
      if (description === undefined)
        throw new Error(t("The robot's limits are not known: there is no robot_description."));
      limits = limitsOf(description);
      const missing = jointsOf(controller).filter((name) => !limits.has(name));
      if (missing.length)
        throw new Error(
          t("robot_description has no limits of position and velocity for {names}: they cannot be moved here.", {
            names: missing.join(", "),
          }),
        );
      this.topic = `${namespaceOf(this.choice.manager)}${controller.name}/command`;
    } catch (error) {
      setText(this.problem, errorText(error));
    }
    for (const name of jointsOf(controller)) {
      const row = this.makeRow(name, limits.get(name));
      this.rows.set(name, row);
      this.list.append(row.element);
    }
    this.endState = this.link.subscribe(
      { topic: `${namespaceOf(this.choice.manager)}${controller.name}/state`, mode: "latest" },
      ({ message }) => {
        if (message) this.received(message);
      },
    );
    this.enable();
  }

  makeRow(name, limits) {
    const { lower, upper, isPrismatic } = limits ?? { lower: NaN, upper: NaN, isPrismatic: false };
    const row = { name, ...limits, position: NaN, command: NaN };
    const set = (value) => {
      if (!this.isOn) return;
      row.command = Math.min(upper, Math.max(lower, value));
      this.showRow(row);
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
      set(row.command + (step * (upper - lower)) / 100);
    });
    row.input = h("input", {
      type: "number",
      step: "any",
      "aria-label": t("command to {name}", { name }),
      onchange: () => {
        const value = Number(row.input.value);
        if (row.input.value !== "" && Number.isFinite(value)) set(value);
        this.showRow(row);
      },
    });
    row.input.addEventListener("blur", () => this.showRow(row, true));
    row.actual = h("span", { class: "num joint-value", title: "Actual position" }, "–");
    row.element = h(
      "div",
      { class: "joint commanded" },
      h("span", { class: "name" }, name),
      h("span", { class: "num muted" }, limits ? shown(lower) : ""),
      row.slider,
      h("span", { class: "num muted high" }, limits ? shown(upper) : ""),
      row.input,
      row.actual,
      h("span", { class: "muted" }, isPrismatic ? "m" : "rad"),
    );
    row.element.dataset.joint = name;
    return row;
  }

  showRow(row, isLeft = false) {
    const { lower, upper, command, position } = row;
    setText(row.actual, Number.isFinite(position) ? shown(position) : "–");
    if (!Number.isFinite(command)) return;
    row.slider.value = String(upper > lower ? ((command - lower) / (upper - lower)) * STEPS : STEPS / 2);
    row.slider.setAttribute("aria-valuetext", shown(command));
    if (isLeft || document.activeElement !== row.input) row.input.value = shown(command);
  }

  // --- states and commands

  received({ joint_names, actual }) {
    joint_names.forEach((name, index) => {
      const row = this.rows.get(name);
      if (!row) return;
      row.position = actual.positions[index];
      this.showRow(row);
    });
    this.followPositions();
    this.enable();
  }

  /** While no commands are sent, each slider is where its joint is. */
  followPositions() {
    if (this.isOn) return;
    for (const row of this.rows.values()) {
      row.command = row.position;
      this.showRow(row);
    }
  }

  get isReady() {
    const rows = [...this.rows.values()];
    return (
      Boolean(this.topic) &&
      this.link.mayWrite &&
      rows.length > 0 &&
      rows.every(({ command }) => Number.isFinite(command))
    );
  }

  enable() {
    this.switch.disabled = !this.isOn && !this.isReady;
    this.switch.checked = this.isOn;
    this.switchLabel.classList.toggle("on", this.isOn);
    for (const row of this.rows.values()) row.slider.disabled = row.input.disabled = !this.isOn;
  }

  /** Begin to send commands, from where the joints are; or end that: the controller then holds its joints. */
  turn(isOn) {
    const wasOn = this.isOn;
    this.isOn = isOn && this.isReady && this.drive.isOpen;
    if (isOn) setText(this.problem, this.isOn ? "" : t("Not connected: this was not done. Try again in a moment."));
    if (wasOn && !this.isOn) this.drive.send({ leave: this.topic });
    if (this.isOn && !wasOn) this.tick();
    this.followPositions();
    this.enable();
  }

  tick() {
    if (!this.isOn) return;
    const rows = [...this.rows.values()];
    const speed = Math.min(100, Math.max(1, Number(this.speed.value) || USUAL_SPEED)) / 100;
    this.drive.send({
      topic: this.topic,
      joints: rows.map(({ name }) => name),
      positions: rows.map(({ command }) => command),
      seconds: secondsOf(rows, speed),
    });
  }

  answered({ lost, error, stopped }) {
    if (!lost && !error && !stopped) return;
    if (error) setText(this.problem, error);
    else if (this.isOn)
      setText(
        this.problem,
        stopped
          ? t("stopped by the server: this page was silent")
          : t("The connection was lost: the controller holds its joints."),
      );
    this.isOn = false;
    this.followPositions();
    this.enable();
  }
}

function shown(value) {
  return String(Number(value.toFixed(3)));
}
