// The 3D view: RViz in the page. The picture with its tools on the left, the displays on the right.

import { fill, h, setText } from "../dom.js";
import { t } from "../texts.js";
import { classForType, CLASSES, classOf, getSetting, newSettings, topicKeyOf } from "./classes.js";
import { boundsOf } from "./bounds.js";
import { rgbOf } from "./colors.js";
import { Config, readView, writeView } from "./config.js";
import { Context } from "./context.js";
import { Camera } from "./displays/camera.js";
import { Cloud } from "./displays/cloud.js";
import { DepthCloud } from "./displays/depth.js";
import { Axes, Grid, TF } from "./displays/frames.js";
import { InteractiveMarkers } from "./displays/interactive.js";
import { MapDisplay } from "./displays/map.js";
import { Markers } from "./displays/markers.js";
import {
  GridCells,
  Linked,
  Odometry,
  Path,
  PointStamped,
  Polygon,
  Pose,
  PoseArray,
  Range,
  Wrench,
} from "./displays/poses.js";
import { RobotModel } from "./displays/robot.js";
import { Files } from "./files.js";
import { Panel } from "./panel.js";
import { Stage } from "./stage.js";
import { TOOLS, Tools } from "./tools.js";

const DISPLAYS = {
  __proto__: null, // a file may name a class constructor
  Grid,
  Axes,
  TF,
  RobotModel,
  LaserScan: Cloud,
  PointCloud2: Cloud,
  PointCloud: Cloud,
  Map: MapDisplay,
  Marker: Markers,
  MarkerArray: Markers,
  InteractiveMarkers,
  Path,
  Pose,
  PoseWithCovariance: Pose,
  PoseArray,
  Odometry,
  Polygon,
  Range,
  PointStamped,
  GridCells,
  WrenchStamped: Wrench,
  Wrench,
  Image: Linked,
  Camera,
  DepthCloud,
};
const MAX_AUTOMATIC = 20; // displays that are added without a click
const LEFT_OUT = /_updates$|^\/rosout|^\/gazebo\/window\//; // the last ones are for the view Simulation
const SMALL_ARROW = { "Shaft Length": 0.25, "Shaft Radius": 0.03, "Head Length": 0.1, "Head Radius": 0.08 }; // metres
const SETTLED_LOOKS = 3; // with one fixed frame, before the camera is put to the robot
const ROBOT_SIZES = 3; // distance of the camera at the start, in diameters of the robot
const VIEWS = { orbit: "Orbit", top: "Top down", follow: "Follow" };

export class SceneView {
  constructor(link, words, main) {
    this.link = link;
    this.hasFile = words.has("file");
    this.displays = new Map(); // settings -> display
    this.dismissed = new Set(); // topics whose display was removed
    this.state = this.restored();
    this.config = this.state.config;
    if (words.has("frame")) this.config.fixedFrame = words.get("frame");

    this.frame = h("div", { class: "panel canvas scene" });
    this.hint = h("span", { class: "muted", role: "status" });
    this.place = h("span", { class: "mono muted" });
    this.fixed = h("select", { "aria-label": "Fixed frame", onchange: () => this.chooseFixed(this.fixed.value) });
    this.kind = h(
      "select",
      { "aria-label": "View", onchange: () => this.chooseView() },
      Object.entries(VIEWS).map(([value, title]) => h("option", { value }, t(title))),
    );
    this.target = h("select", { "aria-label": "Target frame", onchange: () => this.chooseView() });
    this.toolbar = h(
      "div",
      { class: "tools", role: "toolbar", "aria-label": "Tools" },
      Object.entries(this.toolTable).map(([name, { title, key }]) => {
        const button = h(
          "button",
          {
            type: "button",
            class: "small",
            title: `${t(title)} (${key})`,
            "aria-pressed": "false",
            onclick: () => this.tools.choose(name),
          },
          title,
        );
        button.dataset.tool = name;
        return button;
      }),
    );
    this.files = new Files(this);
    this.sideButton = h(
      "button",
      { type: "button", class: "small", "aria-pressed": "true", onclick: () => this.toggleSide() },
      "Displays",
    );
    this.panel = new Panel(this);
    main.append(
      h(
        "div",
        { class: "bar scenebar" },
        this.toolbar,
        h("label", {}, "Fixed frame", this.fixed),
        h("label", {}, "View", this.kind),
        h("label", {}, t("of"), this.target),
        h(
          "button",
          { type: "button", class: "small", title: "Back to the view at the start", onclick: () => this.resetView() },
          "Reset",
        ),
        this.files.element,
        this.sideButton,
      ),
      h("div", { class: "split" }, this.frame, this.panel.element),
      h("div", { class: "bar status" }, this.hint, this.place),
    );

    this.stage = new Stage(this.frame);
    this.context = new Context(link, this.stage, () => {
      this.panel.isStale = true;
    });
    this.tools = this.makeTools();
    this.stage.onTick = () => this.context.tick([...this.displays.values(), ...this.fixedDisplays()]);
    this.stage.onAim = (camera) => {
      for (const display of this.displays.values()) display.face?.(camera);
    };
    this.stage.onView = () => this.viewChanged();
    this.toggleSide(this.isSideShown());
    this.apply();
    this.tools.choose("move");
    const leave = () => this.save();
    addEventListener("pagehide", leave);
    this.ends = [
      link.watch(["channels", "parameters"], () => this.addNew()),
      () => removeEventListener("pagehide", leave),
    ];
    this.startView = this.isRestored ? "" : JSON.stringify(this.stage.view);
    this.timer = setInterval(() => this.look(), 300);
    if (this.hasFile && !this.state.isOpened) this.files.read();
  }

  close() {
    this.save();
    clearInterval(this.timer);
    clearTimeout(this.saving);
    for (const end of this.ends) end();
    for (const display of [...this.displays.values(), ...this.fixedDisplays()]) display.close();
    this.tools.close();
    this.context.close();
    this.stage.close();
  }

  // --- what the window of a simulation does in another way

  /** Where the browser keeps what is shown. */
  get key() {
    return "3d";
  }

  /** @returns {Record<string, any>} the tools by name, as TOOLS */
  get toolTable() {
    return TOOLS;
  }

  makeTools() {
    return new Tools(this);
  }

  /** Return what is shown at first. */
  first() {
    return { config: new Config(), isAutomatic: !this.hasFile };
  }

  isSideShown() {
    return localStorage.getItem(`${this.key} side`) !== "hidden" && innerWidth > 700;
  }

  /** Return displays that are not in the configuration. */
  fixedDisplays() {
    return [];
  }

  // --- what is shown, kept by the browser; that of a file until the page is loaded again

  restored() {
    const text = (this.hasFile ? sessionStorage : localStorage).getItem(this.key);
    try {
      const { raw, isAutomatic, dismissed, isOpened, origin } = JSON.parse(text);
      // Another command's file.
      if (origin && origin !== location.origin) throw new Error();
      this.dismissed = new Set(dismissed);
      this.isRestored = true;
      return { config: new Config(raw), isAutomatic, isOpened };
    } catch {
      return { ...this.first(), isOpened: false };
    }
  }

  save() {
    writeView(this.config.view, { ...this.stage.view });
    const { isAutomatic, isOpened } = this.state;
    const store = this.hasFile ? sessionStorage : localStorage;
    try {
      store.setItem(
        this.key,
        JSON.stringify({
          raw: this.config.raw,
          isAutomatic,
          isOpened,
          dismissed: [...this.dismissed],
          origin: this.hasFile ? location.origin : "",
        }),
      );
    } catch {
      // A browser that keeps nothing.
    }
  }

  /** Save soon: settings change often while they are typed. */
  changed() {
    clearTimeout(this.saving);
    this.saving = setTimeout(() => this.save(), 500);
  }

  /** Show another configuration. Throws Error if it is none. */
  open(raw) {
    this.startView = "";
    this.config = new Config(raw);
    this.state = { config: this.config, isAutomatic: false, isOpened: true };
    this.dismissed.clear();
    this.apply();
    const unknown = this.config.unknown();
    this.say(
      unknown.length ? t("not shown, but kept when it is saved: {names}", { names: unknown.join(", ") }) : t("opened"),
      unknown.length > 0,
    );
    this.changed();
  }

  apply() {
    this.stage.background = rgbOf(this.config.background);
    const { kind, ...view } = readView(this.config.view);
    this.stage.setView({ kind, ...view });
    this.context.chooseFixed(this.config.fixedFrame);
    this.updateDisplays();
    this.showFrames();
  }

  /** Start and stop displays so that they are those of the configuration. */
  updateDisplays() {
    const wanted = this.config.displays();
    const known = new Set(wanted.map(({ settings }) => settings));
    for (const [settings, display] of this.displays) {
      if (known.has(settings) && wanted.find((each) => each.settings === settings).isOn) continue;
      display.close();
      this.displays.delete(settings);
    }
    for (const { settings, isOn } of wanted) {
      const Made = DISPLAYS[classOf(settings)];
      if (isOn && Made && !this.displays.has(settings)) this.displays.set(settings, new Made(this.context, settings));
    }
    this.context.isFresh = true;
    this.panel.fill();
  }

  /** Add displays of topics that are new, if that is wished. */
  addNew() {
    if (!this.state.isAutomatic) return;
    const shown = this.config.displays();
    const topics = new Set(shown.map(({ settings }) => getSetting(settings, topicKeyOf(classOf(settings)))));
    let isChanged = false;
    if (
      this.link.parameters.has("/robot_description") &&
      !shown.some(({ settings }) => classOf(settings) === "RobotModel") &&
      !this.dismissed.has("RobotModel")
    ) {
      this.config.add(newSettings("RobotModel"));
      isChanged = true;
    }
    for (const { topic, type } of this.link.channels.values()) {
      const name = classForType(type);
      if (!name || CLASSES[name].isLinked || topics.has(topic) || this.dismissed.has(topic) || LEFT_OUT.test(topic))
        continue;
      // What the page itself publishes by its tools.
      if (Object.values(TOOLS).some((tool) => tool.topic === topic) || this.config.displays().length >= MAX_AUTOMATIC)
        continue;
      this.config.add(this.newDisplay(name, topic));
      isChanged = true;
    }
    if (isChanged) {
      this.updateDisplays();
      this.changed();
    }
  }

  newDisplay(name, topic) {
    const settings = newSettings(name, topic);
    if (topic) settings.Name = `${name} ${topic}`;
    if (name === "Map" && /costmap/.test(topic)) Object.assign(settings, { "Color Scheme": "costmap", Alpha: 0.4 });
    // Larger than RViz's, to be seen from where the view starts.
    if (name === "LaserScan") settings["Size (m)"] = 0.04;
    if (name === "PointCloud2" || name === "PointCloud") settings["Size (m)"] = 0.02;
    if (name === "Path" && /local/.test(topic)) settings.Color = "255; 170; 0";
    // RViz shows a hundred arrows of a metre.
    if (name === "Odometry") Object.assign(settings, SMALL_ARROW, { Keep: 1, Trail: 1000 });
    return settings;
  }

  add(name, topic = "") {
    const settings = this.newDisplay(name, topic);
    this.dismissed.delete(topic || name);
    this.config.add(settings);
    this.updateDisplays();
    this.changed();
    return settings;
  }

  remove(settings) {
    this.dismissed.add(getSetting(settings, topicKeyOf(classOf(settings))) || classOf(settings));
    this.config.remove(settings);
    this.updateDisplays();
    this.changed();
  }

  /** A setting of a display was changed. */
  set(settings, path) {
    if (path === "Enabled") this.updateDisplays();
    else this.displays.get(settings)?.changed(path);
    this.context.isFresh = true;
    this.changed();
  }

  setAutomatic(isAutomatic) {
    this.state.isAutomatic = isAutomatic;
    this.addNew();
    this.changed();
  }

  // --- frames and views

  look() {
    if (this.startView) this.lookAtRobot();
    this.showFrames();
    this.panel.look();
  }

  showFrames() {
    const { frames, fixedFrame } = this.context;
    const key = `${frames.shape} ${fixedFrame} ${this.config.fixedFrame} ${this.stage.view.target} ${this.stage.view.kind}`;
    if (key === this.shownFrames) return;
    this.shownFrames = key;
    const names = new Set([...frames.names(), ...(this.config.fixedFrame ? [this.config.fixedFrame] : [])]);
    const options = (first) => [first, ...[...names].sort().map((name) => h("option", { value: name }, name))];
    fill(
      this.fixed,
      options(
        h(
          "option",
          { value: "" },
          this.config.fixedFrame ? t("automatic") : t("automatic: {name}", { name: fixedFrame }),
        ),
      ),
    );
    this.fixed.value = this.config.fixedFrame;
    const { target } = this.stage.view;
    if (target !== "<Fixed Frame>") names.add(target);
    fill(this.target, options(h("option", { value: "<Fixed Frame>" }, "fixed frame")));
    this.target.value = target;
    this.kind.value = this.stage.view.kind;
  }

  chooseFixed(name) {
    this.config.fixedFrame = name;
    this.context.chooseFixed(name);
    this.context.isFresh = true;
    this.shownFrames = "";
    this.showFrames();
    this.changed();
  }

  chooseView() {
    const { view } = this.stage;
    const kind = this.kind.value;
    let target = this.target.value;
    if (kind === "follow" && target === "<Fixed Frame>")
      target = ["base_footprint", "base_link"].find((name) => this.context.frames.has(name)) ?? target;
    const parts = { kind, target };
    if (target !== view.target) parts.focus = [0, 0, 0];
    else if (kind === "top") parts.focus = [view.focus[0], view.focus[1], 0];
    // About as much is seen as before.
    if (kind === "top" && view.kind !== "top") parts.scale = this.stage.height / (view.distance * 0.83);
    if (kind !== "top" && view.kind === "top") parts.distance = this.stage.height / (view.scale * 0.83);
    this.stage.setView(parts);
    this.stage.base = { p: [0, 0, 0], yaw: 0 };
    this.context.isFresh = true;
    this.showFrames();
  }

  resetView() {
    this.stage.setView({
      kind: "orbit",
      distance: 10,
      focus: [0, 0, 0],
      pitch: 0.785398,
      yaw: 0.785398,
      angle: 0,
      scale: 50,
      target: "<Fixed Frame>",
    });
    this.stage.base = { p: [0, 0, 0], yaw: 0 };
    this.showFrames();
  }

  viewChanged() {
    this.changed();
  }

  /** Put the camera to where the robot is seen, once it is there, unless the view was changed before. */
  lookAtRobot() {
    if (this.hasFile || JSON.stringify(this.stage.view) !== this.startView) {
      this.startView = "";
      return;
    }
    // The fixed frame changes while the first transforms come.
    const { fixedFrame } = this.context;
    this.looks = fixedFrame === this.lookedAt ? this.looks + 1 : 0;
    this.lookedAt = fixedFrame;
    if (this.looks < SETTLED_LOOKS) return;
    const robot = [...this.displays.values()].find((display) => display instanceof RobotModel);
    const bounds = robot?.isPlaced() ? boundsOf(robot.object) : null;
    if (!bounds) return;
    this.startView = "";
    this.stage.setView({ focus: bounds.center, distance: Math.max(0.2, ROBOT_SIZES * bounds.diameter) });
  }

  /** Turn the view around a point of the fixed frame. */
  focus({ x, y, z }) {
    const { p, yaw } = this.stage.base;
    const [dx, dy] = [x - p[0], y - p[1]];
    this.stage.setView({
      focus: [
        dx * Math.cos(yaw) + dy * Math.sin(yaw),
        dy * Math.cos(yaw) - dx * Math.sin(yaw),
        this.stage.view.kind === "top" ? 0 : z - p[2],
      ],
    });
    this.tools.choose("move");
    this.say(t("the view turns around {place}", { place: `(${x.toFixed(2)}, ${y.toFixed(2)}, ${z.toFixed(2)})` }));
  }

  pickable() {
    return [...this.displays]
      .filter(([settings]) => !["TF", "Grid"].includes(classOf(settings)))
      .map(([, display]) => display.object)
      .concat(this.fixedDisplays().map(({ object }) => object));
  }

  // --- the bars

  chosen(name) {
    // Handles of interactive markers are for the mouse; another tool has it.
    this.context.isInteracting = name === "move";
    this.stage.invalidate();
    for (const button of this.toolbar.children)
      button.setAttribute("aria-pressed", String(button.dataset.tool === name));
  }

  say(text, isError = false) {
    setText(this.hint, text);
    this.hint.classList.toggle("error", isError);
  }

  showPlace(point) {
    setText(
      this.place,
      point
        ? t("{place} in {frame}", {
            place: `x ${point.x.toFixed(2)} y ${point.y.toFixed(2)} m`,
            frame: this.context.fixedFrame,
          })
        : "",
    );
  }

  toggleSide(isShown = this.panel.element.hidden) {
    this.panel.element.hidden = !isShown;
    this.sideButton.setAttribute("aria-pressed", String(isShown));
    localStorage.setItem(`${this.key} side`, isShown ? "" : "hidden");
  }
}
