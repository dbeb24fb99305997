// Displays of frames themselves: grid, axes, the TF tree.

import { Group, Vector3 } from "../../../vendor/three/three.min.js";
import { arrow, axes, bodyMaterial, directed, hairlines } from "../shapes.js";
import { missingText } from "../transforms.js";
import { t } from "../../texts.js";
import { Display } from "./display.js";

const MAX_CELLS = 1000;
const ARROW_COLORS = [
  [255, 26, 153],
  [204, 204, 77],
];

/** Return a setting's frame: "" stands for the fixed one. */
const reference = (display) => {
  const name = String(display.get("Reference Frame") ?? "");
  return name === "<Fixed Frame>" || !name ? display.context.fixedFrame : name;
};

/** Return the first of some texts, and how many more there are. */
function someOf(texts, most, between) {
  const shown = texts.slice(0, most).join(between);
  return texts.length > most ? t("{names} and {count} more", { names: shown, count: texts.length - most }) : shown;
}

class Anchored extends Display {
  /** Return the object to show. @returns {any} */
  make() {
    throw new TypeError(`${this.constructor.name} makes no object`);
  }

  start() {
    this.item = this.add(this.make(), "", 0, true);
  }

  update() {
    this.item.frame = reference(this);
    super.update();
    if (this.item.frame === this.context.fixedFrame) this.clearStatus("Transform");
  }
}

export class Grid extends Anchored {
  make() {
    const count = Math.min(MAX_CELLS, Math.max(1, Math.round(this.number("Plane Cell Count", 10))));
    const half = (count * this.number("Cell Size", 1)) / 2;
    const positions = new Float32Array((count + 1) * 12);
    for (let line = 0; line <= count; line++) {
      const at = -half + (line * 2 * half) / count;
      positions.set([at, -half, 0, at, half, 0, -half, at, 0, half, at, 0], line * 12);
    }
    const grid = hairlines(positions, this.color(), this.number("Alpha", 0.5));
    if (this.get("Plane") === "XZ") grid.rotation.x = Math.PI / 2;
    if (this.get("Plane") === "YZ") grid.rotation.y = Math.PI / 2;
    grid.position.fromArray(["X", "Y", "Z"].map((name) => this.number(`Offset/${name}`)));
    const group = new Group();
    group.add(grid);
    return group;
  }
}

export class Axes extends Anchored {
  make() {
    return axes(this.number("Length", 1), this.number("Radius", 0.1));
  }
}

export class TF extends Display {
  start() {
    this.frames = new Map(); // name -> {item, label, line}
  }

  stop() {
    for (const name of [...(this.frames?.keys() ?? [])]) this.drop(name);
    super.stop();
  }

  drop(name) {
    const { item, label, line } = this.frames.get(name);
    this.frames.delete(name);
    this.remove(item);
    this.remove(line);
    this.context.stage.labels.remove(label);
  }

  parts() {
    return this.context.frames.names().map((name) => ({
      name,
      isShown: this.isShown(name),
      set: (isShown) => {
        this.settings.Frames ??= { "All Enabled": true };
        this.settings.Frames[name] = { Value: isShown };
      },
    }));
  }

  changed(path) {
    if (path !== "Frames") this.restart();
  }

  isShown(name) {
    const own = this.settings.Frames?.[name];
    return (own?.Value ?? own) !== false && (own !== undefined || this.settings.Frames?.["All Enabled"] !== false);
  }

  make(name) {
    const group = new Group();
    group.name = name;
    const scale = this.number("Marker Scale", 1);
    const cross = axes(0.2 * scale, 0.02 * scale);
    cross.visible = this.get("Show Axes") !== false;
    group.add(cross);
    const line = { object: this.makeArrow(scale) };
    line.object.visible = false;
    this.object.add(line.object);
    return { item: this.add(group, name, 0, true), label: this.context.stage.labels.add({ text: name }), line };
  }

  /** The arrow from a frame to its parent, of length 1. */
  makeArrow(scale) {
    const shape = arrow(bodyMaterial(ARROW_COLORS[1]), {
      shaft: 1,
      shaftWidth: 0.01 * scale,
      head: 0,
      headWidth: 0.04 * scale,
    });
    /** @type {any} */ (shape.children[1]).material = bodyMaterial(ARROW_COLORS[0]);
    return shape;
  }

  update() {
    const { frames } = this.context;
    const names = new Set(frames.names().filter((name) => this.isShown(name)));
    if (!names.size && !frames.known.size) this.setStatus("Transforms", 1, t("No tf data"));
    for (const name of this.frames.keys()) if (!names.has(name)) this.drop(name);
    for (const name of names) if (!this.frames.has(name)) this.frames.set(name, this.make(name));

    const missing = [];
    const silent = [];
    for (const [name, each] of this.frames) {
      if (this.isSilent(name)) {
        if (each.item.object.visible) this.context.stage.invalidate();
        each.item.object.visible = false;
        silent.push(name);
        continue;
      }
      this.context.place(each.item);
      if (each.item.error) missing.push(missingText(name, this.context.fixedFrame, each.item.error));
    }
    const isOn = this.object.visible;
    for (const [name, { item, label, line }] of this.frames) {
      const isSeen = item.object.visible;
      label.isShown = isOn && isSeen && this.get("Show Names") !== false;
      label.place.copy(item.object.position);
      const parent = this.frames.get(frames.parent(name))?.item.object;
      this.point(
        line.object,
        item.object.position,
        isSeen && parent?.visible && this.get("Show Arrows") !== false ? parent.position : null,
      );
    }
    if (silent.length)
      this.setStatus(
        "Timeout",
        1,
        t("no transform for {time} s: {names}", {
          time: this.number("Frame Timeout", 15),
          names: someOf(silent, 5, ", "),
        }),
      );
    else this.clearStatus("Timeout");
    if (missing.length) this.setStatus("Transforms", 1, someOf(missing, 3, "; "));
    else if (names.size) this.setStatus("Transforms", 0, t("{count} frames", { count: names.size }));
  }

  /**
   * Return whether nobody has published a frame's transform for the timeout; while time is simulated, it may stand
   * still.
   */
  isSilent(name) {
    const edge = this.context.frames.edges.get(name);
    const timeout = this.number("Frame Timeout", 15) * 1000;
    return (
      Boolean(edge) &&
      !edge.isStatic &&
      timeout > 0 &&
      this.context.link.time === null &&
      performance.now() - edge.heard > timeout
    );
  }

  point(shape, from, to) {
    const way = to ? from.distanceTo(to) : 0;
    shape.visible = way > 1e-3;
    if (!shape.visible) return;
    const head = Math.min(0.1 * this.number("Marker Scale", 1), way * 0.4);
    const [shaft, point] = shape.children;
    shaft.scale.x = way - head;
    point.position.x = way - head;
    point.scale.x = head;
    directed(shape, from, new Vector3().copy(to));
  }
}
