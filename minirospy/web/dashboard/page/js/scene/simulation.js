// The 3D view as the window of a simulation: its world in place of the displays of topics, and tools that drag and push
// models.

import { AmbientLight, DirectionalLight, Vector3 } from "../../vendor/three/three.min.js";
import { setText } from "../dom.js";
import { MODEL_STATE, stateOf, topicOf, viewOf } from "../simulation.js";
import { errorText, t } from "../texts.js";
import { newSettings, setSetting } from "./classes.js";
import { Config, newConfig } from "./config.js";
import { Markers } from "./displays/markers.js";
import { World } from "./displays/world.js";
import { TOOLS, Tools } from "./tools.js";
import { SceneView } from "./view.js";

const DRAG_MS = 33; // between two poses of what is dragged
const HOVER_MS = 100; // between two searches for the model under the mouse
const STILL = 4; // pixels of a click
const MIN_LEVEL = 0.1; // of a view's direction, for a level push
const FIRST_VIEW = { distance: 6, pitch: 0.45, yaw: 0.6 };
const BACKGROUNDS = { light: "206; 214; 224", dark: "38; 43; 51" };
const SIM_TOOLS = {
  move: { ...TOOLS.move, title: "Select", hint: "click a model: select · drag: turn · shift: move · wheel: zoom" },
  drag: { title: "Drag", key: "g", hint: "drag a model over the ground; with shift: up and down" },
  push: { title: "Push", key: "p", hint: "click a model: it is pushed there, away from you" },
  focus: TOOLS.focus,
  measure: TOOLS.measure,
};

export class SimulationScene extends SceneView {
  /**
   * `window`: {selected(model), call(service, request), push(hit, direction), changed(), unfollowed()}, the
   * view around it.
   */
  constructor(link, main, window) {
    super(link, new URLSearchParams(), main);
    this.window = window;
    this.world = new World(this.context, () => window.changed());
    this.overlays = new Map(); // "contacts" or "rays" -> display
    this.followed = "";
    this.light();
    this.showTheme();
    const theme = () => this.showTheme();
    link.addEventListener("theme", theme);
    const scheme = matchMedia("(prefers-color-scheme: dark)");
    scheme.addEventListener("change", theme);
    this.ends.push(
      () => link.removeEventListener("theme", theme),
      () => scheme.removeEventListener("change", theme),
    );
  }

  /** Light a world as a sun and a sky do: walls that face away from the viewer are not black. */
  light() {
    const { stage } = this;
    const sun = new DirectionalLight(0xffffff, Math.PI * 0.35);
    sun.position.set(4, -3, 8);
    stage.light.intensity = Math.PI * 0.3;
    stage.scene.add(sun, new AmbientLight(0xffffff, Math.PI * 0.5));
  }

  get key() {
    return "simulation";
  }

  get toolTable() {
    return SIM_TOOLS;
  }

  makeTools() {
    return new SimulationTools(this);
  }

  first() {
    const raw = newConfig();
    /** @type {any} */
    const manager = raw["Visualization Manager"];
    const grid = newSettings("Grid");
    Object.assign(grid, { "Plane Cell Count": 20, Color: "110; 120; 135", Alpha: 0.35 });
    setSetting(grid, "Offset/Z", 0.004); // above the ground plane
    manager.Displays = [grid];
    manager["Global Options"]["Fixed Frame"] = "world";
    Object.assign(manager.Views.Current, {
      Distance: FIRST_VIEW.distance,
      Pitch: FIRST_VIEW.pitch,
      Yaw: FIRST_VIEW.yaw,
    });
    return { config: new Config(raw), isAutomatic: false };
  }

  isSideShown() {
    return false;
  }

  fixedDisplays() {
    return this.world ? [this.world, ...this.overlays.values()] : [];
  }

  showTheme() {
    const { background } = this.config;
    if (
      !Object.values(BACKGROUNDS).includes(background) &&
      background !== newConfig()["Visualization Manager"]["Global Options"]["Background Color"]
    )
      return;
    const { theme } = document.documentElement.dataset;
    const isDark = theme ? theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
    this.config.background = BACKGROUNDS[isDark ? "dark" : "light"];
    this.apply();
  }

  /** Show or hide contacts or rays. */
  setOverlay(name, isOn) {
    if (isOn && !this.overlays.has(name))
      this.overlays.set(name, new Markers(this.context, newSettings("MarkerArray", topicOf(name))));
    else if (!isOn) {
      this.overlays.get(name)?.close();
      this.overlays.delete(name);
    }
    this.context.isFresh = true;
  }

  /** Look as the world's camera does, once; "" is a world without a camera. */
  showCamera(camera) {
    this.camera = camera;
    const key = `${this.key} camera`;
    if ((localStorage.getItem(key) ?? "") === camera) return;
    localStorage.setItem(key, camera);
    this.resetView();
  }

  resetView() {
    this.followed = "";
    super.resetView();
    this.stage.setView(viewOf(this.camera ?? "") ?? FIRST_VIEW);
    this.window.unfollowed();
  }

  /** Let the view follow a link, or stand again with "". */
  follow(link) {
    const { context, stage } = this;
    if (link === this.followed || (link && !context.frames.has(link))) return;
    const at = (name) => (name && context.transformNow(name)?.p) || [0, 0, 0];
    const [before, after] = [at(this.followed), at(link)];
    this.followed = link;
    // A view that stands stays where it is; one that follows looks at the link.
    const focus = link ? [0, 0, 0] : stage.view.focus.map((part, index) => part + before[index] - after[index]);
    stage.setView({ kind: "orbit", target: link || "<Fixed Frame>", focus });
    stage.base = { p: after, yaw: 0 };
    context.isFresh = true;
    this.showFrames();
  }
}

class SimulationTools extends Tools {
  constructor(view) {
    super(view);
    this.pressed = null; // {x, y} of a press that may be a click
    this.over = ""; // the model under the mouse
    this.hovered = 0; // when it was looked for
    this.dragged = null; // what is dragged: {model, pose, last, by, timer}
  }

  close() {
    this.drop();
    super.close();
  }

  choose(name) {
    this.drop();
    super.choose(name);
  }

  down(event) {
    const [x, y] = this.at(event);
    this.pressed = event.button === 0 && !this.pointers.size ? { x, y } : null;
    if (this.name === "drag" && this.pressed) this.grab(x, y);
    super.down(event);
    if (this.pointers.size > 1) this.drop();
    // Beside a model it is the view that is dragged.
    if (this.held && this.name === "drag") this.held.isView = !this.dragged;
  }

  move(event) {
    const [x, y] = this.at(event);
    if (this.pressed && Math.hypot(x - this.pressed.x, y - this.pressed.y) > STILL) this.pressed = null;
    if (this.dragged) {
      this.drag(x, y, event.shiftKey);
      return;
    }
    if (this.name === "drag" && this.held?.isView && this.pointers.size < 2) {
      const { stage } = this.view;
      if (event.shiftKey) stage.pan(x - this.held.x, y - this.held.y);
      else stage.rotate(x - this.held.x, y - this.held.y);
      Object.assign(this.held, { x, y });
      return;
    }
    super.move(event);
  }

  up(event) {
    const { pressed } = this;
    this.pressed = null;
    this.drop();
    super.up(event);
    if (pressed && event.type === "pointerup" && ["move", "drag"].includes(this.name))
      this.view.window.selected(this.view.world.find(pressed.x, pressed.y)?.model ?? "");
  }

  /** Show the name of the model under the mouse, too. */
  hover(x, y) {
    super.hover(x, y);
    const now = performance.now();
    if (now - this.hovered > HOVER_MS) {
      this.hovered = now;
      this.over = this.view.world.find(x, y)?.model ?? "";
    }
    const { place } = this.view;
    if (this.over) setText(place, [this.over, place.textContent].filter(Boolean).join(" · "));
  }

  click(x, y) {
    if (this.name === "push") this.push(x, y);
    else if (this.name !== "drag") super.click(x, y);
  }

  push(x, y) {
    const hit = this.view.world.find(x, y);
    if (!hit) {
      this.view.say(t("there is nothing at this place"), true);
      return;
    }
    const direction = this.view.stage.camera.getWorldDirection(new Vector3());
    // Level: a push downwards would mostly add friction. From straight above it is downwards.
    if (Math.hypot(direction.x, direction.y) > MIN_LEVEL) direction.setZ(0).normalize();
    this.view.window.selected(hit.model);
    this.view.window.push(hit, direction.toArray());
  }

  // --- dragging

  grab(x, y) {
    const { view } = this;
    const hit = view.world.find(x, y);
    if (!hit) return;
    if (!view.link.mayWrite) {
      view.say(t("This token is read-only."), true);
      return;
    }
    const dragged = { model: hit.model, pose: null, last: hit.point.clone(), by: new Vector3(), timer: 0 };
    this.dragged = dragged;
    view.window.selected(hit.model);
    view.link.advertise(MODEL_STATE.topic, MODEL_STATE.type, MODEL_STATE.schema);
    this.advertised.add(MODEL_STATE.topic);
    view.window.call("get_model_state", { model_name: hit.model, relative_entity_name: "" }).then(
      ({ pose }) => {
        dragged.pose = pose;
        if (this.dragged !== dragged) return;
        this.send();
        dragged.timer = setInterval(() => this.send(), DRAG_MS);
      },
      (error) => {
        view.say(errorText(error), true);
        if (this.dragged === dragged) this.dragged = null;
      },
    );
  }

  drag(x, y, isLifting) {
    const { dragged } = this;
    const { stage } = this.view;
    const { origin, direction } = stage.ray(x, y).ray;
    let next;
    if (isLifting) {
      // Where the ray passes the vertical line through the point.
      const level = Math.hypot(direction.x, direction.y);
      if (level < 1e-3) return;
      const away = Math.hypot(dragged.last.x - origin.x, dragged.last.y - origin.y);
      next = dragged.last.clone().setZ(origin.z + (direction.z / level) * away);
    } else {
      const far = (dragged.last.z - origin.z) / direction.z;
      if (!(far > 0) || far > 1000) return;
      next = origin.clone().addScaledVector(direction, far);
    }
    dragged.by.add(next.clone().sub(dragged.last));
    dragged.last.copy(next);
  }

  send() {
    const { model, pose, by } = this.dragged;
    const { x, y, z } = pose.position;
    const moved = { ...pose, position: { x: x + by.x, y: y + by.y, z: z + by.z } };
    this.view.link
      .publish(MODEL_STATE.topic, MODEL_STATE.type, MODEL_STATE.schema, stateOf(model, moved))
      .catch((error) => {
        clearInterval(this.dragged?.timer);
        this.dragged = null;
        this.view.say(errorText(error), true);
      });
  }

  drop() {
    const { dragged } = this;
    if (!dragged) return;
    clearInterval(dragged.timer);
    if (dragged.pose) this.send();
    this.dragged = null;
  }
}
