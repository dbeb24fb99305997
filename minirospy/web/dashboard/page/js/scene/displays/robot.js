// The robot: the links of its description at the frames of TF; where TF has none of them, by the positions of its
// joints.

import { Group, Mesh } from "../../../vendor/three/three.min.js";
import { loadMesh, loadTexture } from "../meshes.js";
import { BALL, bodyMaterial, BOX, ROLL } from "../shapes.js";
import { compose, missingText, plainName } from "../transforms.js";
import { linkPoses, parseUrdf } from "../urdf.js";
import { t } from "../../texts.js";
import { Display } from "./display.js";

const PLAIN = [255, 0, 0, 1]; // as in RViz, a link without a material is red

export class RobotModel extends Display {
  start() {
    this.text = undefined;
    this.robot = null;
    this.links = new Map(); // name -> item
    this.positions = new Map();
    this.ends = [this.context.link.watch(["parameters", "state"], () => this.read())];
    const topic = String(this.get("Joint States") ?? "");
    if (topic)
      this.ends.push(
        this.context.link.subscribe({ topic, mode: "latest" }, ({ message }) => message && this.moved(message)),
      );
  }

  stop() {
    for (const end of this.ends ?? []) end();
    this.ends = [];
    super.stop();
  }

  moved({ name, position }) {
    if (!Array.isArray(name) || position === undefined) return;
    name.forEach((each, index) => this.positions.set(each, position[index] ?? 0));
    this.poses = null;
    this.context.received(this);
  }

  /** Read the description's parameter, if it has changed. */
  read() {
    const name = String(this.get("Robot Description") || "robot_description");
    const key = name.startsWith("/") ? name : `/${name}`;
    const text = this.context.link.parameters.get(key) ?? null;
    if (text === this.text) return;
    this.text = text;
    this.loading = { count: 0, failed: [] };
    this.clearStatus("Meshes");
    for (const item of [...this.items]) this.remove(item);
    this.links.clear();
    this.robot = null;
    if (typeof text !== "string") {
      this.setStatus("URDF", 2, t("Parameter [{name}] does not exist, and was not found by searchParam()", { name }));
      return;
    }
    try {
      this.robot = parseUrdf(text);
    } catch (error) {
      this.setStatus("URDF", 2, t("URDF failed Model parse: {why}", { why: error.message }));
      return;
    }
    const { notes } = this.robot;
    this.setStatus("URDF", notes.length ? 1 : 0, [t("URDF parsed OK"), ...notes].join("; "));
    this.poses = null;
    for (const link of this.robot.links.values())
      this.links.set(link.name, this.add(this.build(link), this.frameOf(link.name), 0, true));
    this.context.received(this);
  }

  frameOf(link) {
    const prefix = String(this.get("TF Prefix") ?? "");
    return prefix ? `${prefix}/${link}` : link;
  }

  build({ visuals, collisions }) {
    const group = new Group();
    const shown = [
      ...(this.get("Visual Enabled") === false ? [] : visuals),
      ...(this.get("Collision Enabled") === true ? collisions : []),
    ];
    for (const { origin, geometry, ...own } of shown) {
      // As in RViz, shapes without a material have that of the link's first shape.
      const { color, texture } = own.color || own.texture ? own : (visuals[0] ?? own);
      const holder = new Group();
      holder.position.fromArray(origin.p);
      holder.quaternion.fromArray(origin.q);
      this.fill(holder, geometry, color, texture);
      group.add(holder);
    }
    return group;
  }

  fill(holder, geometry, color, texture) {
    const [r, g, b, a] = color ? [color[0] * 255, color[1] * 255, color[2] * 255, color[3]] : PLAIN;
    const alpha = a * this.number("Alpha", 1);
    if (geometry.kind === "mesh") {
      this.load(async () => {
        const map = texture ? await loadTexture(this.context.link, texture) : null;
        const rgb = map ? [255, 255, 255] : [r, g, b];
        const mesh = await loadMesh(this.context.link, geometry.uri, { rgb, alpha, map });
        mesh.scale.multiply({ x: geometry.scale[0], y: geometry.scale[1], z: geometry.scale[2] });
        holder.add(mesh);
      });
      return;
    }
    const material = bodyMaterial([r, g, b], alpha);
    if (texture) {
      this.load(async () => {
        material.map = await loadTexture(this.context.link, texture);
        material.color.setRGB(1, 1, 1);
        material.needsUpdate = true;
      });
    }
    const shape = new Mesh({ box: BOX, sphere: BALL, cylinder: ROLL }[geometry.kind], material);
    if (geometry.kind === "box") shape.scale.fromArray(geometry.size);
    else if (geometry.kind === "sphere") shape.scale.setScalar(geometry.radius * 2);
    else shape.scale.set(geometry.radius * 2, geometry.radius * 2, geometry.length);
    holder.add(shape);
  }

  /** Return whether all that can be shown of the robot is at its place. */
  isPlaced() {
    return Boolean(this.robot) && !this.loading.count && [...this.links.values()].some(({ object }) => object.visible);
  }

  /** Load a mesh or a texture; a failure is the status of the display. */
  async load(work) {
    const { loading } = this;
    loading.count += 1;
    try {
      await this.context.stage.load(work);
    } catch (error) {
      loading.failed.push(error.message);
    }
    loading.count -= 1;
    if (loading !== this.loading) return; // the description was replaced
    const [first, ...others] = new Set(loading.failed);
    if (first)
      this.setStatus("Meshes", 2, first + (others.length ? t("; and {count} more", { count: others.length }) : ""));
    else if (!loading.count) this.clearStatus("Meshes");
  }

  update() {
    if (!this.robot) return;
    const { frames, fixedFrame } = this.context;
    const missing = [];
    for (const [name, item] of this.links) {
      const frame = this.frameOf(name);
      if (frames.has(frame) || plainName(frame) === fixedFrame) this.context.place(item);
      else item.error = { message: t("Frame [{frame}] does not exist", { frame }) };
      if (item.error && !this.placeByJoints(name, item)) {
        item.object.visible = false;
        missing.push([frame, item.error]);
      }
    }
    if (missing.length) {
      const [[frame, error]] = missing;
      this.setStatus(
        "Transform",
        2,
        missingText(frame, fixedFrame, error) +
          (missing.length > 1 ? t("; and {count} more links", { count: missing.length - 1 }) : ""),
      );
    } else this.setStatus("Transform", 0, t("Transform OK"));
  }

  /** Put a link where the positions of the joints have it, below the root link; return whether that is possible. */
  placeByJoints(name, item) {
    if (!this.positions.size) return false;
    this.poses ??= linkPoses(this.robot, this.positions);
    const { frames, fixedFrame } = this.context;
    const root = this.frameOf(this.robot.root);
    // Without any tf data at all the robot is at the origin.
    const base =
      this.context.transformNow(root) ??
      (frames.known.size && fixedFrame !== root ? null : { p: [0, 0, 0], q: [0, 0, 0, 1] });
    if (!base || !this.poses.has(name)) return false;
    this.context.put(item, compose(base, this.poses.get(name)));
    return true;
  }
}
