// Markers of visualization_msgs: shapes by namespace and number, until they are deleted or their lifetime ends.

import { Group, Mesh, Vector3 } from "../../../vendor/three/three.min.js";
import { loadMesh } from "../meshes.js";
import {
  arrow,
  BALL,
  bodyMaterial,
  BOX,
  chain,
  directed,
  points as pointCloud,
  ROLL,
  segments,
  solids,
  triangles,
} from "../shapes.js";
import { fromMessage, secondsOf } from "../transforms.js";
import { t } from "../../texts.js";
import { TopicDisplay } from "./display.js";

const [ADD, DELETE, DELETE_ALL] = [0, 2, 3];
const KINDS = [
  "Arrow",
  "Cube",
  "Sphere",
  "Cylinder",
  "Line Strip",
  "Line List",
  "Cube List",
  "Sphere List",
  "Points",
  "View Facing Text",
  "Mesh Resource",
  "Triangle List",
];
const MOST = 10_000; // markers of a display
const WHITE = [255, 255, 255];
const MAX_SPACES = 1000; // namespaces in the list of settings

const rgbOf = ({ r, g, b }) => [r * 255, g * 255, b * 255];
const flat = (points) => {
  const found = new Float32Array(points.length * 3);
  points.forEach(({ x, y, z }, index) => found.set([x, y, z], index * 3));
  return found;
};

export class Markers extends TopicDisplay {
  get mode() {
    return "all";
  }

  start() {
    this.markers = new Map(); // "namespace/id" -> {item, label, until}
    this.spaces = new Set();
    super.start();
    // Real RViz shows arrays with the suffix as well; a Marker display takes both types of topics.
    if (this.topic && this.types.length === 1)
      this.ends.push(this.listen(`${this.topic}_array`, "all", (message) => this.received(message)));
  }

  stop() {
    for (const key of [...(this.markers?.keys() ?? [])]) this.drop(key);
    super.stop();
  }

  received(message) {
    const list = message.markers ?? [message];
    let error = null;
    for (const marker of list) {
      try {
        this.process(marker);
      } catch (failed) {
        error = new Error(`${marker.ns}/${marker.id}: ${failed.message}`);
      }
    }
    if (error) throw error;
    this.setStatus("Markers", 0, t("{count} markers", { count: this.markers.size }));
  }

  process(marker) {
    const key = `${marker.ns}/${marker.id}`;
    if (marker.action === DELETE_ALL) {
      for (const each of [...this.markers.keys()]) this.drop(each);
      return;
    }
    if (marker.action === DELETE) {
      this.drop(key);
      return;
    }
    if (marker.action !== ADD) throw new Error(t("the action {action} is not known", { action: marker.action }));
    if (!this.spaces.has(marker.ns) && this.spaces.size < MAX_SPACES) {
      this.spaces.add(marker.ns);
      this.context.statusChanged();
    }
    if (!this.markers.has(key) && this.markers.size >= MOST)
      throw new Error(t("more than {count} markers", { count: MOST }));

    const made = makeMarker(marker, this);
    this.drop(key);
    const lifetime = secondsOf(marker.lifetime);
    const item = this.add(made.object, marker.header.frame_id, secondsOf(marker.header.stamp), marker.frame_locked);
    if (made.label) {
      item.follow = (matrix) => made.label.place.copy(made.offset).applyMatrix4(matrix);
      item.settled = -1;
    }
    this.markers.set(key, {
      item,
      label: made.label,
      space: marker.ns,
      until: lifetime > 0 ? performance.now() + lifetime * 1000 : Infinity,
    });
  }

  isShown(space) {
    return this.settings.Namespaces?.[space] !== false;
  }

  /** Return the namespaces, for the list of settings. */
  parts() {
    return [...this.spaces].sort().map((space) => ({
      name: space || t("(no namespace)"),
      isShown: this.isShown(space),
      set: (isShown) => {
        this.settings.Namespaces = { ...this.settings.Namespaces, [space]: isShown };
      },
    }));
  }

  changed(path) {
    if (path !== "Frames") this.restart();
    this.context.stage.invalidate();
  }

  drop(key) {
    const known = this.markers.get(key);
    if (!known) return;
    this.markers.delete(key);
    this.remove(known.item);
    if (known.label) this.context.stage.labels.remove(known.label);
  }

  update() {
    const now = performance.now();
    for (const [key, { until }] of this.markers) if (until < now) this.drop(key);
    super.update();
    for (const { item, label, space } of this.markers.values()) {
      const isShown = this.isShown(space);
      item.object.visible &&= isShown;
      // Shown again if its frame still has a transform.
      if (isShown && !item.object.visible && !item.error) item.object.visible = true;
      if (label) label.isShown = item.object.visible;
    }
  }
}

/** Return {object, label, offset} of a marker; its frame's transform is applied around it. Throws Error. */
export function makeMarker(marker, display) {
  const build = MAKERS[marker.type];
  if (!build) throw new Error(t("the marker type {type} is not known", { type: marker.type }));
  const numbers = [
    ...Object.values(marker.pose.position),
    ...Object.values(marker.pose.orientation),
    ...Object.values(marker.scale),
  ];
  if (!numbers.every(Number.isFinite))
    throw new Error(t("Marker contained invalid floating point values (nans or infs)"));
  const group = new Group();
  const pose = fromMessage(marker.pose);
  const made = build(marker, display);
  group.userData.kind = KINDS[marker.type];
  if (made.text !== undefined) {
    const { r, g, b, a } = marker.color;
    const label = display.context.stage.labels.add({
      text: made.text,
      kind: "marker",
      metres: marker.scale.z,
      color: `rgb(${[r, g, b].map((part) => Math.round(part * 255)).join(" ")} / ${a})`,
    });
    return { object: group, label, offset: new Vector3(...pose.p) };
  }
  const placed = new Group();
  placed.add(made);
  placed.position.fromArray(pose.p);
  placed.quaternion.fromArray(pose.q);
  group.add(placed);
  return { object: group, label: null };
}

function body(geometry) {
  return ({ scale, color }) => {
    const mesh = new Mesh(geometry, bodyMaterial(rgbOf(color), color.a));
    mesh.scale.set(scale.x || 1e-6, scale.y || 1e-6, scale.z || 1e-6);
    return mesh;
  };
}

function makeArrow({ points, scale, color }) {
  const material = bodyMaterial(rgbOf(color), color.a);
  if (points.length === 0)
    return arrow(material, {
      shaft: scale.x * 0.77,
      shaftWidth: scale.y,
      head: scale.x * 0.23,
      headWidth: scale.y * 2,
    });
  if (points.length === 1) throw new Error(t("an arrow needs no points, or two"));
  const [from, to] = points.map(({ x, y, z }) => new Vector3(x, y, z));
  const length = from.distanceTo(to);
  if (!length) return new Group();
  const head = scale.z > 0 ? Math.min(scale.z, length) : length * 0.23;
  return directed(arrow(material, { shaft: length - head, shaftWidth: scale.x, head, headWidth: scale.y }), from, to);
}

function makeLines(isStrip) {
  return ({ points, colors, scale, color }) => {
    if (!isStrip && points.length % 2) throw new Error(t("a line list needs an even number of points"));
    const positions = flat(points);
    const own =
      colors.length === points.length && colors.length
        ? Float32Array.from(colors.flatMap(({ r, g, b }) => [r, g, b]))
        : null;
    return segments(isStrip ? chain(positions) : positions, {
      rgb: rgbOf(color),
      colors: own && isStrip ? chain(own) : own,
      alpha: own ? colors[0].a : color.a,
      metres: scale.x,
    });
  };
}

/** Return the colors of a marker's points as bytes, null if it has none for each. */
const ownColors = ({ points, colors }) =>
  colors.length === points.length && colors.length
    ? Uint8Array.from(colors.flatMap(({ r, g, b }) => [r, g, b].map((part) => Math.min(Math.max(part, 0), 1) * 255)))
    : null;

function makeList(isRound) {
  return (marker) => {
    const { points, colors, scale, color } = marker;
    const own = ownColors(marker);
    return solids(flat(points), own, {
      rgb: rgbOf(color),
      alpha: own ? colors[0].a : color.a,
      size: [scale.x, scale.y, scale.z],
      isRound,
    });
  };
}

function makePoints(marker) {
  const { points, colors, scale, color } = marker;
  const own = ownColors(marker);
  return pointCloud(flat(points), own, {
    rgb: rgbOf(color),
    alpha: own ? colors[0].a : color.a,
    size: Math.max(scale.x, scale.y),
    isMetres: true,
  });
}

function makeTriangles({ points, colors, scale, color }) {
  if (!points.length || points.length % 3) throw new Error(t("a triangle list needs three points for each triangle"));
  let own = null;
  if (colors.length === points.length) own = Float32Array.from(colors.flatMap(({ r, g, b }) => [r, g, b]));
  else if (colors.length === points.length / 3)
    own = Float32Array.from(colors.flatMap(({ r, g, b }) => [r, g, b, r, g, b, r, g, b]));
  const mesh = triangles(flat(points), own, rgbOf(color), own ? colors[0].a : color.a);
  mesh.scale.set(scale.x, scale.y, scale.z);
  return mesh;
}

function makeMesh({ mesh_resource: uri, mesh_use_embedded_materials: isOwn, scale, color }, display) {
  const holder = new Group();
  holder.scale.set(scale.x, scale.y, scale.z);
  const isUnset = color.r === 0 && color.g === 0 && color.b === 0 && color.a === 0;
  const paint = isOwn
    ? { tint: isUnset ? null : rgbOf(color), alpha: isUnset ? 1 : color.a, rgb: isUnset ? WHITE : rgbOf(color) }
    : { rgb: rgbOf(color), alpha: color.a, isForced: true };
  const { link, stage } = display.context;
  stage
    .load(async () => holder.add(await loadMesh(link, uri, paint)))
    .catch((error) => display.setStatus("Message", 2, error.message));
  return holder;
}

const MAKERS = [
  makeArrow,
  body(BOX),
  body(BALL),
  body(ROLL),
  makeLines(true),
  makeLines(false),
  makeList(false),
  makeList(true),
  makePoints,
  ({ text }) => ({ text }),
  makeMesh,
  makeTriangles,
];
