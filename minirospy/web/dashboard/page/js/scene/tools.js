// What the mouse does: turning, moving and zooming the view; poses, goals and points that are published; measuring;
// focus.

import { Group } from "../../vendor/three/three.min.js";
import { t } from "../texts.js";
import { Grips } from "./grips.js";
import { schema } from "./schemas.js";
import { arrow, bodyMaterial, discard, segments } from "./shapes.js";
import { fromYaw } from "./transforms.js";

const PUBLISHED = {
  "geometry_msgs/PoseWithCovarianceStamped": schema("Header header\nPoseWithCovariance pose"),
  "geometry_msgs/PoseStamped": schema("Header header\nPose pose"),
  "geometry_msgs/PointStamped": schema("Header header\nPoint point"),
};
const DEVIATION = 0.5; // metres, of RViz's pose estimate
const TURN = Math.PI / 12; // its deviation in radians

/** Name -> {title, key, hint, class in files, topic, type}. */
export const TOOLS = {
  move: {
    title: "Move camera",
    key: "m",
    hint: globalThis.matchMedia?.("(pointer: coarse)").matches
      ? "one finger: turn · two fingers: move, zoom"
      : "drag: turn · shift or middle button: move · wheel or right button: zoom",
  },
  focus: { title: "Focus", key: "c", hint: "click what the view is to turn around" },
  measure: { title: "Measure", key: "n", hint: "click two points" },
  pose: {
    title: "2D Pose Estimate",
    key: "p",
    hint: "press where the robot is, and drag to where it looks",
    tool: "SetInitialPose",
    topic: "/initialpose",
    type: "geometry_msgs/PoseWithCovarianceStamped",
  },
  goal: {
    title: "2D Nav Goal",
    key: "g",
    hint: "press where the robot is to go, and drag to where it shall look",
    tool: "SetGoal",
    topic: "/move_base_simple/goal",
    type: "geometry_msgs/PoseStamped",
  },
  point: {
    title: "Publish Point",
    key: "u",
    hint: "click a point",
    tool: "PublishPoint",
    topic: "/clicked_point",
    type: "geometry_msgs/PointStamped",
  },
};

/** The tools of a view: {stage, context, config, link, toolTable, say(text, isError), chosen(name)}. */
export class Tools {
  constructor(view) {
    this.view = view;
    this.name = "move";
    this.pointers = new Map(); // those that are down: id -> [x, y]
    this.held = null; // {x, y, button, start}
    this.preview = null;
    this.advertised = new Set();
    this.measured = { from: null, label: null, line: null };
    this.grips = new Grips(view, t(TOOLS.move.hint));
    const { canvas } = view.stage;
    const on = (name, react) => canvas.addEventListener(name, react);
    on("pointerdown", (event) => this.down(event));
    on("pointermove", (event) => this.move(event));
    for (const name of ["pointerup", "pointercancel"]) on(name, (event) => this.up(event));
    on("wheel", (event) => {
      event.preventDefault();
      const [x, y] = this.at(event);
      view.stage.zoom(Math.exp(-Math.sign(event.deltaY) * Math.min(Math.abs(event.deltaY), 100) * 0.0015), x, y);
    });
    on("contextmenu", (event) => event.preventDefault());
    on("keydown", (event) => this.key(event));
  }

  close() {
    this.clear();
    this.grips.close();
    for (const topic of this.advertised) this.view.link.unpublish(topic);
  }

  choose(name) {
    this.clear();
    this.grips.leave();
    this.name = name;
    this.view.stage.canvas.dataset.tool = name;
    const { topic, type } = this.target(name);
    // Before the click: subscribers need a moment to connect.
    if (topic && this.view.link.mayWrite) {
      this.view.link.advertise(topic, type, PUBLISHED[type]);
      this.advertised.add(topic);
    }
    this.view.chosen(name);
    this.view.say(t(this.view.toolTable[name].hint));
  }

  target(name) {
    const { tool, topic, type } = this.view.toolTable[name];
    return { topic: topic && this.view.config.toolTopic(tool, topic), type };
  }

  /** Remove what a tool has drawn. */
  clear() {
    const { from, label, line } = this.measured;
    if (label) this.view.stage.labels.remove(label);
    for (const object of [line, this.preview]) if (object) discard(object);
    this.preview = null;
    this.measured = { from: null, label: null, line: null };
    if (from || line) this.view.stage.invalidate();
  }

  at(event) {
    const box = this.view.stage.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  // --- events

  down(event) {
    const { stage } = this.view;
    stage.canvas.setPointerCapture(event.pointerId);
    stage.canvas.focus({ preventScroll: true });
    const [x, y] = this.at(event);
    this.pointers.set(event.pointerId, [x, y]);
    if (this.pointers.size > 1) {
      // Two fingers: not the tool, but the view.
      this.held = null;
      this.grips.cancel();
      this.dropPreview();
      return;
    }
    if (this.name === "move" && this.grips.down(event, x, y)) return;
    this.held = { x, y, button: event.button, start: null };
    if (this.name === "move" || event.button !== 0) return;
    event.preventDefault();
    if (this.name === "pose" || this.name === "goal") this.held.start = stage.ground(x, y);
    else this.click(x, y);
  }

  move(event) {
    const { stage } = this.view;
    const [x, y] = this.at(event);
    if (this.pointers.size === 2 && this.pointers.has(event.pointerId)) {
      this.pinch(event.pointerId, x, y);
      return;
    }
    if (this.grips.move(event, x, y)) return;
    const { held } = this;
    if (!held) {
      this.hover(x, y);
      return;
    }
    const [dx, dy] = [x - held.x, y - held.y];
    if (held.start) this.aim(held.start, stage.ground(x, y));
    else if (this.name === "move" || held.button !== 0) {
      const isMoved =
        held.button === 1 || event.shiftKey || (stage.view.kind === "top" && held.button === 0 && !event.altKey);
      if (held.button === 2) stage.zoom(Math.exp(-dy * 0.01));
      else if (isMoved) stage.pan(dx, dy);
      else stage.rotate(dx, dy);
    }
    Object.assign(held, { x, y });
  }

  up(event) {
    this.pointers.delete(event.pointerId);
    if (this.grips.up(event, ...this.at(event))) return;
    const { held } = this;
    this.held = null;
    if (held?.start && event.type === "pointerup") {
      const [x, y] = this.at(event);
      const end = this.view.stage.ground(x, y) ?? held.start;
      const yaw = end.distanceTo(held.start) > 1e-6 ? Math.atan2(end.y - held.start.y, end.x - held.start.x) : 0;
      this.publishPose(held.start, yaw);
    }
    this.dropPreview();
  }

  pinch(id, x, y) {
    const { stage } = this.view;
    const other = [...this.pointers].find(([each]) => each !== id)[1];
    const before = this.pointers.get(id);
    const apart = ([ax, ay], [bx, by]) => Math.hypot(ax - bx, ay - by) || 1;
    stage.zoom(apart([x, y], other) / apart(before, other));
    stage.pan((x - before[0]) / 2, (y - before[1]) / 2);
    this.pointers.set(id, [x, y]);
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const table = this.view.toolTable;
    const found = Object.keys(table).find((name) => table[name].key === event.key.toLowerCase());
    if (found) this.choose(found);
    else if (event.key === "Escape") this.choose("move");
    else {
      const { stage } = this.view;
      const way = { ArrowLeft: [-40, 0], ArrowRight: [40, 0], ArrowUp: [0, -40], ArrowDown: [0, 40] }[event.key];
      if (way && event.shiftKey) stage.pan(-way[0], -way[1]);
      else if (way) stage.rotate(...way);
      else if (event.key === "+") stage.zoom(1.2);
      else if (event.key === "-") stage.zoom(1 / 1.2);
      else return;
    }
    event.preventDefault();
  }

  // --- what tools do

  hover(x, y) {
    const { stage } = this.view;
    if (this.name === "measure" && this.measured.from && !this.measured.isDone) {
      const to = stage.pick(x, y, this.view.pickable());
      if (to) this.measure(to);
    }
    if (this.name === "move") this.grips.hover(x, y);
    const ground = stage.ground(x, y);
    this.view.showPlace(ground && stage.camera.position.distanceTo(ground) < 3000 ? ground : null);
  }

  click(x, y) {
    const { stage } = this.view;
    const point = stage.pick(x, y, this.view.pickable());
    if (!point) {
      this.view.say(t("there is nothing at this place"), true);
      return;
    }
    if (this.name === "focus") this.view.focus(point);
    else if (this.name === "point") this.publishPoint(point);
    else if (!this.measured.from || this.measured.isDone) {
      this.clear();
      this.measured.from = point;
    } else {
      this.measure(point);
      this.measured.isDone = true;
    }
  }

  measure(to) {
    const { stage } = this.view;
    const { measured } = this;
    if (measured.line) discard(measured.line);
    measured.line = segments(Float32Array.from([...measured.from, ...to]), { rgb: [255, 200, 0], pixels: 3 });
    measured.line.userData.isUnpicked = true;
    stage.scene.add(measured.line);
    const length = measured.from.distanceTo(to);
    measured.label ??= stage.labels.add({ text: "", kind: "measure" });
    stage.labels.change(measured.label, `${length.toFixed(3)} m`);
    measured.label.place.copy(to);
    measured.label.isShown = true;
    stage.invalidate();
    this.view.say(t("Length: {length} m", { length: length.toFixed(4) }));
  }

  aim(from, to) {
    this.dropPreview();
    if (!to || to.distanceTo(from) < 1e-6) return;
    const { stage } = this.view;
    const size =
      Math.max(0.15, 70 / stage.pixelsPerMetre) *
      (stage.view.kind === "top" ? 1 : stage.camera.position.distanceTo(from));
    const shape = arrow(bodyMaterial(this.name === "goal" ? [255, 40, 200] : [60, 230, 60]), {
      shaft: size * 0.7,
      shaftWidth: size * 0.1,
      head: size * 0.3,
      headWidth: size * 0.28,
    });
    this.preview = new Group();
    this.preview.add(shape);
    this.preview.position.copy(from);
    this.preview.rotation.z = Math.atan2(to.y - from.y, to.x - from.x);
    stage.scene.add(this.preview);
    stage.invalidate();
  }

  dropPreview() {
    if (!this.preview) return;
    discard(this.preview);
    this.preview = null;
    this.view.stage.invalidate();
  }

  publishPose({ x, y }, yaw) {
    const [qx, qy, qz, qw] = fromYaw(yaw);
    const pose = { position: { x, y, z: 0 }, orientation: { x: qx, y: qy, z: qz, w: qw } };
    const covariance = new Array(36).fill(0);
    [covariance[0], covariance[7], covariance[35]] = [DEVIATION ** 2, DEVIATION ** 2, TURN ** 2];
    this.publish(
      this.name === "pose" ? { pose: { pose, covariance } } : { pose },
      `(${x.toFixed(3)}, ${y.toFixed(3)}), ${((yaw * 180) / Math.PI).toFixed(1)}°`,
    );
  }

  publishPoint({ x, y, z }) {
    this.publish({ point: { x, y, z } }, `(${x.toFixed(3)}, ${y.toFixed(3)}, ${z.toFixed(3)})`);
  }

  async publish(fields, shown) {
    const { topic, type } = this.target(this.name);
    const { context, link } = this.view;
    const header = { seq: 0, stamp: context.stamp(), frame_id: context.fixedFrame };
    this.choose("move");
    try {
      await link.publish(topic, type, PUBLISHED[type], { header, ...fields });
      this.view.say(t("published {topic}: {value} in {frame}", { topic, value: shown, frame: context.fixedFrame }));
    } catch (error) {
      this.view.say(`${topic}: ${error.message}`, true);
    }
  }
}
