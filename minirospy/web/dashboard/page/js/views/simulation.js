// The window of a simulation under Gazebo's names: its world in three dimensions; pause, step, speed, reset; models
// that are selected, moved, pushed, inserted and deleted; joints; contacts and rays.

import { fill, h, redraw, setText, uniqueId } from "../dom.js";
import {
  clockText,
  DIRECTIONS,
  freeName,
  heightOf,
  jointsOf,
  librarySdf,
  QUIET_MS,
  readName,
  readNumber,
  readState,
  SHAPES,
  shapeSdf,
  splitLink,
  threeDecimals,
  topicOf,
  toRpy,
} from "../simulation.js";
import { MAX_EFFORT_SECONDS, SimulationServices } from "../simulation_services.js";
import { errorText, t } from "../texts.js";

const LOOK_MS = 500; // between two looks at the selected model
const LIST_MS = 3000; // between two looks at the list of models
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 0]; // 0 is as fast as possible
const POSE = ["x", "y", "z", "roll", "pitch", "yaw"];
const COLORS = ["#d9822b", "#3b7dd8", "#3a9a5b", "#c2453d", "#8a5fc7"];
const LIBRARY = "model";

export class Simulation {
  constructor(link, words, main, place) {
    this.link = link;
    this.services = new SimulationServices(link);
    this.place = place;
    this.state = null; // of the simulation, null until it is known
    this.stateAt = 0; // when it came
    this.models = [];
    this.model = words.get("model") ?? ""; // that is selected
    this.properties = null; // of the selected model
    this.scene = null;
    this.isClosed = false;
    this.inserted = 0;
    this.main = main;
    this.build();
    main.append(this.bar, this.problem, this.empty, this.split);
    this.load();
    this.ends = [
      link.subscribe({ topic: topicOf("state"), mode: "latest" }, ({ message }) => message && this.received(message)),
      link.watch(["services", "channels", "state"], () => this.look()),
    ];
    this.timers = [
      setInterval(() => this.look(), LOOK_MS),
      setInterval(() => !document.hidden && this.list(), LIST_MS),
      setInterval(() => !document.hidden && this.readPose(), LOOK_MS),
    ];
    this.showShape();
  }

  close() {
    this.isClosed = true;
    for (const timer of this.timers) clearInterval(timer);
    for (const end of this.ends) end();
    this.endJoints?.();
    this.scene?.close();
    this.services.close();
  }

  // --- elements

  build() {
    this.problem = h("p", { class: "error", role: "alert" });
    this.empty = h("p", { class: "empty" });
    this.buildBar();
    this.buildModels();
    this.buildSelected();
    this.buildInsert();
    this.frame = h("div", { class: "sim-scene" });
    this.side = h("div", { class: "panel side sim-side" }, this.modelSection, this.selectedSection, this.insertSection);
    this.split = h("div", { class: "split sim-split", hidden: true }, this.frame, this.side);
  }

  button(text, title, run, properties = {}) {
    return h("button", { type: "button", class: "small", title, onclick: () => this.act(run), ...properties }, text);
  }

  buildBar() {
    this.playButton = this.button("❚❚", "Pause", () => this.services.pause(!this.state?.isPaused), {
      class: "sim-play",
    });
    this.steps = h("input", { class: "short", inputmode: "numeric", value: "1", "aria-label": "Steps" });
    this.stepButton = this.button("Step", "Advance a paused simulation by so many steps", () => this.step());
    this.speed = h("select", { "aria-label": "Speed", onchange: () => this.act(() => this.setSpeed()) });
    this.world = h("strong", { class: "name" });
    this.time = h("span", { class: "sim-time", title: "Simulated time" });
    this.factor = h("span", { class: "muted", title: "Real-time factor" });
    const toggle = (name, title) => {
      const button = h(
        "button",
        {
          type: "button",
          class: "small",
          "aria-pressed": "false",
          onclick: () => {
            const isOn = button.getAttribute("aria-pressed") !== "true";
            button.setAttribute("aria-pressed", String(isOn));
            this.scene?.setOverlay(name, isOn);
          },
        },
        title,
      );
      return button;
    };
    this.toggles = { contacts: toggle("contacts", "Contacts"), rays: toggle("rays", "Rays") };
    this.bar = h(
      "div",
      { class: "bar sim-bar", hidden: true },
      this.playButton,
      this.steps,
      this.stepButton,
      h("label", {}, "Speed", this.speed),
      this.button("Reset world", "All models return to the start; the time goes on", () =>
        this.services.call("reset_world"),
      ),
      this.button("Reset time", "Models and time return to the start", () => this.services.call("reset_simulation")),
      Object.values(this.toggles),
      h("span", { class: "spring" }),
      this.world,
      this.time,
      this.factor,
    );
  }

  buildModels() {
    this.rows = h("div", { class: "sim-models" });
    this.count = h("span", { class: "muted" });
    this.modelSection = h("section", {}, h("h3", {}, t("Models"), " ", this.count), this.rows);
  }

  buildSelected() {
    this.title = h("h3", {});
    this.fields = Object.fromEntries(POSE.map((name) => [name, this.field(name, "0")]));
    this.link_ = h("select", { "aria-label": "Link" });
    this.newtons = this.field("N", "50");
    this.seconds = this.field("s", "0.2");
    this.direction = h(
      "select",
      { "aria-label": "Direction" },
      Object.keys(DIRECTIONS).map((each) => h("option", { value: each }, each)),
    );
    this.followButton = h(
      "button",
      { type: "button", class: "small", "aria-pressed": "false", onclick: () => this.follow() },
      "Follow",
    );
    this.setButton = this.button("Set pose", "Put the model there, at rest", () => this.setPose());
    this.pushButton = this.button("Push", "Apply the force for this time", () => this.pushLink());
    this.jointMode = h(
      "select",
      { "aria-label": "Joints", onchange: () => this.showJointFields() },
      h("option", { value: "position" }, "Position"),
      h("option", { value: "effort" }, t("Force for {seconds} s", { seconds: MAX_EFFORT_SECONDS })),
    );
    this.jointRows = h("div", { class: "sim-joints" });
    this.jointSection = h(
      "div",
      { hidden: true },
      h("div", { class: "bar" }, h("strong", {}, "Joints"), this.jointMode),
      this.jointRows,
    );
    this.pushSection = h(
      "div",
      {},
      h("strong", {}, "Push"),
      h("div", { class: "bar" }, this.link_, this.direction),
      h("div", { class: "sim-fields" }, this.labeled(this.newtons), this.labeled(this.seconds), this.pushButton),
    );
    this.note = h("span", { class: "muted" });
    this.selectedSection = h(
      "section",
      { hidden: true },
      h(
        "div",
        { class: "bar" },
        this.title,
        this.note,
        h("span", { class: "spring" }),
        this.followButton,
        this.button("Delete", "Delete the model", () => this.remove(this.model), { class: "small danger" }),
      ),
      h(
        "div",
        { class: "sim-fields" },
        POSE.map((name) => this.labeled(this.fields[name])),
      ),
      h("div", { class: "bar" }, this.setButton, h("span", { class: "muted" }, t("m and rad, in world"))),
      this.pushSection,
      this.jointSection,
    );
  }

  buildInsert() {
    this.kind = h(
      "select",
      { "aria-label": "Shape", onchange: () => this.showShape() },
      Object.entries(SHAPES).map(([value, { title }]) => h("option", { value }, title)),
      h("option", { value: LIBRARY }, "Model by name"),
    );
    const id = uniqueId("sim-library");
    this.library = h("datalist", { id });
    this.libraryName = h("input", {
      list: id,
      "aria-label": "Model",
      placeholder: "Model",
      hidden: true,
      autocomplete: "off",
    });
    this.libraryName.addEventListener("focus", () => this.readLibrary());
    this.nameField = h("input", { "aria-label": "Name", placeholder: "Name", autocomplete: "off" });
    this.color = h("input", { type: "color", "aria-label": "Color", value: COLORS[0] });
    this.sizes = h("div", { class: "sim-fields" });
    this.at = Object.fromEntries(["x", "y", "z"].map((name) => [name, this.field(name, "")]));
    this.insertSection = h(
      "section",
      {},
      h("h3", {}, "Insert"),
      h("div", { class: "bar" }, this.kind, this.libraryName, this.library, this.color),
      this.sizes,
      h(
        "div",
        { class: "sim-fields" },
        Object.values(this.at).map((field) => this.labeled(field)),
      ),
      h(
        "div",
        { class: "bar" },
        this.nameField,
        this.button("Insert", "Insert the model there", () => this.insert()),
      ),
    );
  }

  field(name, value) {
    const field = h("input", { inputmode: "decimal", "aria-label": name, value, autocomplete: "off" });
    field.addEventListener("input", () => (field.dataset.edited = "1"));
    return field;
  }

  labeled(field) {
    return h("label", {}, h("span", {}, field.getAttribute("aria-label")), field);
  }

  async load() {
    try {
      const { SimulationScene } = await import("../scene/simulation.js");
      if (this.isClosed) return;
      this.scene = new SimulationScene(this.link, this.frame, {
        selected: (model) => this.select(model),
        call: (service, request) => this.services.call(service, request),
        push: (hit, direction) => this.act(() => this.pushHit(hit, direction)),
        changed: () => this.list(),
        unfollowed: () => this.showFollowed(),
      });
      if (this.state) this.scene.showCamera(this.state.camera);
      this.scene.world.select(this.model);
      for (const [name, button] of Object.entries(this.toggles))
        if (button.getAttribute("aria-pressed") === "true") this.scene.setOverlay(name, true);
      this.placeInsert();
    } catch (error) {
      this.say(t("The 3D view cannot be shown: {why}", { why: error.message }));
    }
  }

  // --- what is shown

  say(text) {
    setText(this.problem, text);
  }

  /** Do what a button asks for; what fails is one line. */
  async act(run) {
    this.say("");
    try {
      await run();
    } catch (error) {
      this.say(errorText(error));
    }
  }

  received(message) {
    this.state = readState(message);
    this.stateAt = performance.now();
    this.scene?.showCamera(this.state.camera);
    this.look();
  }

  get isQuiet() {
    return performance.now() - this.stateAt > QUIET_MS;
  }

  look() {
    const { link, services } = this;
    const isRunning = services.isThere;
    for (const part of [this.bar, this.split]) part.hidden = !isRunning;
    setText(
      this.empty,
      isRunning || link.state !== "open"
        ? ""
        : t("No simulation runs. Start one: {command}", { command: "roslaunch gazebo_ros empty_world.launch" }),
    );
    if (!isRunning) {
      this.state = null;
      this.wasThere = false;
      this.models = [];
      return;
    }
    if (!this.wasThere) {
      this.wasThere = true;
      this.stateAt = performance.now();
      this.list();
      this.readProperties();
    }
    const { state } = this;
    setText(this.world, state?.world ?? "");
    setText(this.time, state ? clockText(state.time) : "–");
    setText(
      this.factor,
      this.isQuiet ? t("no answer") : state?.isPaused ? t("paused") : state ? `${state.factor.toFixed(2)} ×` : "",
    );
    this.factor.classList.toggle("error", this.isQuiet);
    const isPaused = state?.isPaused ?? false;
    setText(this.playButton, isPaused ? "▶" : "❚❚");
    const title = t(isPaused ? "Continue" : "Pause");
    this.playButton.title = title;
    this.playButton.setAttribute("aria-label", title);
    this.stepButton.disabled = !isPaused || !link.mayWrite;
    this.playButton.disabled = !link.mayWrite;
    this.showSpeed();
  }

  showSpeed() {
    const { state } = this;
    if (!state || document.activeElement === this.speed) return;
    const now = state.rate > 0 ? Number((state.rate * state.step).toPrecision(3)) : 0;
    const speeds = SPEEDS.includes(now) ? SPEEDS : [now, ...SPEEDS];
    const key = speeds.join();
    if (key !== this.shownSpeeds) {
      this.shownSpeeds = key;
      fill(
        this.speed,
        speeds.map((each) => h("option", { value: String(each) }, each ? `${each} ×` : t("as fast as possible"))),
      );
    }
    this.speed.value = String(now);
  }

  // --- requests

  async step() {
    const count = readNumber(this.steps.value, t("Steps"), { least: 1, most: 1e6 });
    if (!Number.isInteger(count))
      throw new Error(t("{name}: {value} is not a whole number", { name: t("Steps"), value: count }));
    await this.services.step(count);
  }

  async setSpeed() {
    const { state } = this;
    const speed = Number(this.speed.value);
    this.speed.blur();
    const rate = await this.services.setSpeed(speed);
    if (state) state.rate = rate;
  }

  // --- models

  async list() {
    if (!this.services.isThere || this.isListing || this.isClosed) return;
    this.isListing = true;
    const { model } = this;
    try {
      // A page that calls no services has the models that it sees.
      this.models = this.link.mayWrite ? await this.services.models() : (this.scene?.world.models() ?? []);
    } catch (error) {
      if (this.services.isThere) this.say(errorText(error));
    } finally {
      this.isListing = false;
    }
    if (this.isClosed) return;
    // A model that was selected meanwhile may be newer than this list.
    if (model && model === this.model && !this.models.includes(model)) this.select("");
    this.showModels();
  }

  showModels() {
    const drawn = JSON.stringify([this.models, this.model]);
    if (drawn === this.drawnModels) return;
    this.drawnModels = drawn;
    setText(this.count, String(this.models.length));
    redraw(this.rows, () =>
      fill(
        this.rows,
        this.models.map((name) => this.row(name)),
      ),
    );
    if (!this.nameField.dataset.edited) this.proposeName();
  }

  row(name) {
    const row = h(
      "div",
      { class: "sim-model" },
      h(
        "button",
        {
          type: "button",
          class: "link name",
          "aria-pressed": String(name === this.model),
          onclick: () => this.select(name === this.model ? "" : name),
        },
        h("span", {}, name),
      ),
      h(
        "button",
        {
          type: "button",
          class: "small sim-delete",
          title: "Delete the model",
          "aria-label": `${t("Delete")}: ${name}`,
          onclick: () => this.act(() => this.remove(name)),
        },
        "×",
      ),
    );
    row.dataset.model = name;
    return row;
  }

  select(model) {
    if (model === this.model && this.properties) return;
    if (this.scene?.followed && splitLink(this.scene.followed)[0] !== model) this.scene.follow("");
    this.model = model;
    this.properties = null;
    this.place.remember(model ? { model } : {});
    this.scene?.world.select(model);
    this.showModels();
    this.showSelected();
    this.readProperties();
  }

  async readProperties() {
    const { model } = this;
    if (!model || !this.services.isThere || !this.link.mayWrite) return;
    try {
      const properties = await this.services.properties(model);
      if (model !== this.model) return;
      this.properties = properties;
      for (const field of Object.values(this.fields)) delete field.dataset.edited;
      this.showSelected();
      this.readPose();
    } catch (error) {
      if (model === this.model) this.say(errorText(error));
    }
  }

  showSelected() {
    const { model, properties } = this;
    this.selectedSection.hidden = !model;
    this.endJoints?.();
    this.endJoints = null;
    this.joints = [];
    fill(this.jointRows);
    if (!model) return;
    setText(this.title, model);
    setText(this.note, properties?.is_static ? t("static") : "");
    this.pushSection.hidden = !properties || properties.is_static;
    this.followButton.hidden = !properties || properties.is_static;
    this.showFollowed();
    fill(
      this.link_,
      (properties?.body_names ?? []).map((name) => h("option", { value: name }, name)),
    );
    this.jointSection.hidden = !properties?.joint_names.length;
    if (properties?.joint_names.length)
      this.endJoints = this.link.subscribe({ topic: topicOf("joints"), mode: "latest" }, ({ message }) => {
        if (message) this.showJoints(jointsOf(message, model));
      });
  }

  /** Show the pose of the selected model in the fields that nobody edits. */
  async readPose() {
    const { model } = this;
    if (!model || !this.properties || !this.services.isThere || this.isReading || !this.link.mayWrite) return;
    this.isReading = true;
    try {
      const { position: p, orientation: q } = await this.services.pose(model);
      if (model !== this.model) return;
      const values = [p.x, p.y, p.z, ...toRpy([q.x, q.y, q.z, q.w])];
      POSE.forEach((name, index) => {
        const field = this.fields[name];
        const text = threeDecimals(values[index]);
        if (!field.dataset.edited && field !== document.activeElement && field.value !== text) field.value = text;
      });
    } catch {
      // A model that has just gone; a simulation that does not answer shows it by its state.
    } finally {
      this.isReading = false;
    }
  }

  async setPose() {
    const values = POSE.map((name) => readNumber(this.fields[name].value, name));
    await this.services.setPose(this.model, values.slice(0, 3), values.slice(3));
    for (const field of Object.values(this.fields)) delete field.dataset.edited;
  }

  async remove(model) {
    await this.services.remove(model);
    await this.list();
  }

  follow() {
    const first = this.properties?.body_names[0];
    if (!first || !this.scene) return;
    this.scene.follow(this.scene.followed ? "" : `${this.model}::${first}`);
    this.showFollowed();
  }

  showFollowed() {
    this.followButton.setAttribute("aria-pressed", String(Boolean(this.scene?.followed)));
  }

  // --- forces

  readPush() {
    return [
      readNumber(this.newtons.value, "N"),
      readNumber(this.seconds.value, "s", { least: 0, most: 60, isAbove: true }),
    ];
  }

  async pushLink() {
    const [newtons, seconds] = this.readPush();
    const force = DIRECTIONS[this.direction.value].map((part) => part * newtons);
    await this.services.push(`${this.model}::${this.link_.value}`, force, [0, 0, 0], seconds);
  }

  /** Push what is under the mouse away from the viewer. */
  async pushHit({ link, isMoving, point }, direction) {
    if (!isMoving) throw new Error(t("{name} is static: no force moves it", { name: splitLink(link)[0] }));
    const [newtons, seconds] = this.readPush();
    const origin = this.scene.context.transformNow(link)?.p ?? [0, 0, 0];
    const at = point.toArray().map((part, index) => part - origin[index]);
    const force = direction.map((part) => part * newtons);
    await this.services.push(link, force, at, seconds);
    this.scene.say(t("{name}: {newtons} N for {seconds} s", { name: link, newtons, seconds }));
  }

  // --- joints

  showJoints(joints) {
    const names = joints.map(({ name }) => name).join("\n");
    if (names !== this.joints.map(({ name }) => name).join("\n")) {
      this.joints = joints.map((joint) => this.jointRow(joint));
      fill(
        this.jointRows,
        this.joints.map(({ row }) => row),
      );
      this.showJointFields();
    }
    joints.forEach(({ position, velocity }, index) => {
      setText(this.joints[index].shown, threeDecimals(position));
      this.joints[index].shown.title = `${velocity.toFixed(3)} /s`;
    });
  }

  jointRow({ name, position }) {
    const shown = h("span", { class: "num" });
    const field = this.field(name, position.toFixed(2));
    field.setAttribute("aria-label", name); // the robot's word, which is not translated
    const send = h(
      "button",
      { type: "button", class: "small", onclick: () => this.act(() => this.moveJoint(name, field)) },
      "Set",
    );
    const row = h("div", { class: "sim-joint" }, h("span", { class: "name", title: name }, name), shown, field, send);
    row.dataset.joint = name;
    return { name, row, shown, field, send };
  }

  showJointFields() {
    const isForce = this.jointMode.value === "effort";
    for (const { name, field, send } of this.joints) {
      field.value = isForce ? "1" : "0";
      send.title = t(isForce ? "Apply this force (N or N m)" : "Put the joint there (m or rad)");
      send.setAttribute("aria-label", `${t("Set")}: ${name}`);
    }
  }

  async moveJoint(name, field) {
    const value = readNumber(field.value, name);
    const { model, services } = this;
    await (this.jointMode.value === "effort"
      ? services.pushJoint(model, name, value)
      : services.setJoint(model, name, value));
  }

  // --- insert

  showShape() {
    const kind = this.kind.value;
    const isLibrary = kind === LIBRARY;
    this.libraryName.hidden = !isLibrary;
    this.color.hidden = isLibrary;
    this.sizeFields = isLibrary
      ? {}
      : Object.fromEntries(
          Object.entries(SHAPES[kind].sizes).map(([name, value]) => [name, this.field(name, String(value))]),
        );
    fill(
      this.sizes,
      Object.values(this.sizeFields).map((field) => this.labeled(field)),
    );
    delete this.nameField.dataset.edited;
    this.proposeName();
    this.placeInsert();
  }

  proposeName() {
    const stem = this.kind.value === LIBRARY ? this.libraryName.value.trim() : this.kind.value;
    this.nameField.value = stem ? freeName(stem, this.models) : "";
  }

  /** Propose the place that the view looks at. */
  placeInsert() {
    const focus = this.scene?.stage.focalPoint();
    const kind = this.kind.value;
    const height = kind === LIBRARY ? 0 : heightOf(kind, SHAPES[kind].sizes) + 0.3;
    const values = { x: focus?.x ?? 0, y: focus?.y ?? 0, z: height };
    for (const [name, field] of Object.entries(this.at))
      if (!field.dataset.edited) field.value = String(Number(values[name].toFixed(2)));
  }

  async readLibrary() {
    if (this.library.children.length) return;
    try {
      const names = await this.services.library();
      fill(
        this.library,
        names.map((name) => h("option", { value: name })),
      );
    } catch (error) {
      this.say(errorText(error));
    }
  }

  async insert() {
    const kind = this.kind.value;
    const at = ["x", "y", "z"].map((name) => readNumber(this.at[name].value, name));
    let xml;
    if (kind === LIBRARY) {
      xml = librarySdf(this.libraryName.value);
      if (!this.nameField.value.trim()) this.proposeName();
    } else {
      const sizes = Object.fromEntries(
        Object.entries(this.sizeFields).map(([name, field]) => [
          name,
          readNumber(field.value, t(name), { least: 0, most: 1000, isAbove: true }),
        ]),
      );
      xml = shapeSdf(kind, sizes, rgbOf(this.color.value));
    }
    const name = readName(this.nameField.value, this.models);
    await this.services.spawn(name, xml, at);
    delete this.nameField.dataset.edited;
    this.inserted += 1;
    this.color.value = COLORS[this.inserted % COLORS.length];
    await this.list();
    this.select(name);
  }
}

/** Return red, green and blue of a color field, from 0 to 1. */
const rgbOf = (text) => [1, 3, 5].map((at) => parseInt(text.slice(at, at + 2), 16) / 255);
