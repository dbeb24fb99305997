// Frames and the transforms between them over time, as tf2 has them. Pure.
// A transform is {p: [x, y, z], q: [x, y, z, w]}; that from `source` to `target` turns coordinates in source into those
// in target.
// Source: tf2's BufferCore (http://wiki.ros.org/tf2); the texts of its errors are tf2's.

import { t } from "../texts.js";

export const IDENTITY = Object.freeze({ p: [0, 0, 0], q: [0, 0, 0, 1] });
const CACHE_SECONDS = 10; // as in tf2
const MAX_DEPTH = 1000; // frames between one and its root, as in tf2
const MAX_FRAMES = 10_000; // names that never come again would fill the memory
const QUATERNION_TOLERANCE = 0.01; // as in tf2

/** Why there is no transform: kind is "unknown", "unconnected", "loop", "future" or "past". */
export class FrameError extends Error {
  constructor(kind, message) {
    super(message);
    this.kind = kind;
  }
}

/**
 * Return the product of two quaternions [x, y, z, w].
 * @param {number[]} one
 * @param {number[]} other
 */
export function multiply([ax, ay, az, aw], [bx, by, bz, bw]) {
  return [
    aw * bx + ax * bw + ay * bz - az * by,
    aw * by - ax * bz + ay * bw + az * bx,
    aw * bz + ax * by - ay * bx + az * bw,
    aw * bw - ax * bx - ay * by - az * bz,
  ];
}

/**
 * Return a point rotated by a quaternion.
 * @param {number[]} quaternion
 * @param {number[]} point
 */
export function rotate([x, y, z, w], [px, py, pz]) {
  const tx = 2 * (y * pz - z * py);
  const ty = 2 * (z * px - x * pz);
  const tz = 2 * (x * py - y * px);
  return [px + w * tx + y * tz - z * ty, py + w * ty + z * tx - x * tz, pz + w * tz + x * ty - y * tx];
}

/** Return a point's coordinates after a transform. */
export function apply({ p, q }, point) {
  const [x, y, z] = rotate(q, point);
  return [p[0] + x, p[1] + y, p[2] + z];
}

/** Return the transform that applies `inner` first, then `outer`. */
export function compose(outer, inner) {
  return { p: apply(outer, inner.p), q: multiply(outer.q, inner.q) };
}

export function invert({ p, q }) {
  const back = [-q[0], -q[1], -q[2], q[3]];
  const [x, y, z] = rotate(back, p);
  return { p: [-x, -y, -z], q: back };
}

/** Return the transform at a part (0 to 1) of the way between two: linear, and the shorter arc. */
export function interpolate(one, other, part) {
  const p = one.p.map((value, index) => value + (other.p[index] - value) * part);
  let dot = one.q.reduce((sum, value, index) => sum + value * other.q[index], 0);
  const sign = dot < 0 ? -1 : 1;
  dot *= sign;
  let [from, to] = [1 - part, part];
  if (dot < 0.9995) {
    const angle = Math.acos(dot);
    [from, to] = [Math.sin((1 - part) * angle) / Math.sin(angle), Math.sin(part * angle) / Math.sin(angle)];
  }
  return { p, q: normalized(one.q.map((value, index) => value * from + other.q[index] * to * sign)) };
}

/** Return the quaternion of length 1; zero becomes no rotation, as RViz does. */
export function normalized(q) {
  const length = Math.hypot(...q);
  return length > 0 ? q.map((value) => value / length) : [0, 0, 0, 1];
}

/**
 * Return the quaternion of roll, pitch and yaw, as URDF has them.
 * @param {number[]} rpy
 */
export function fromRpy([roll, pitch, yaw]) {
  const [cr, sr] = [Math.cos(roll / 2), Math.sin(roll / 2)];
  const [cp, sp] = [Math.cos(pitch / 2), Math.sin(pitch / 2)];
  const [cy, sy] = [Math.cos(yaw / 2), Math.sin(yaw / 2)];
  return [
    sr * cp * cy - cr * sp * sy,
    cr * sp * cy + sr * cp * sy,
    cr * cp * sy - sr * sp * cy,
    cr * cp * cy + sr * sp * sy,
  ];
}

export const fromYaw = (yaw) => [0, 0, Math.sin(yaw / 2), Math.cos(yaw / 2)];
export const yawOf = ([x, y, z, w]) => Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));

/** Return the transform of a geometry_msgs/Pose or Transform. */
export function fromMessage({ position, translation, orientation, rotation }) {
  const { x, y, z } = position ?? translation;
  const turned = orientation ?? rotation;
  return { p: [x, y, z], q: normalized([turned.x, turned.y, turned.z, turned.w]) };
}

export const secondsOf = ({ secs, nsecs }) => secs + nsecs / 1e9;
export const plainName = (frame) => (frame.startsWith("/") ? frame.slice(1) : frame);

/** The tree. */
export class Frames {
  constructor() {
    this.clear();
  }

  clear() {
    this.edges = new Map(); // child -> {parent, isStatic, stamps, transforms, heard}
    this.known = new Set();
    this.version = (this.version ?? 0) + 1;
    this.shape = (this.shape ?? 0) + 1; // changes with names and parents only
  }

  /** Take over the transforms of a tf2_msgs/TFMessage; return the texts of those that are refused. */
  insertMessage({ transforms }, isStatic, heard = 0) {
    const refused = [];
    for (const { header, child_frame_id: child, transform } of transforms) {
      const error = this.insert(header.frame_id, child, secondsOf(header.stamp), transform, isStatic, heard);
      if (error) refused.push(error);
    }
    return refused;
  }

  /** Take over a transform; return "", or why it is refused. `heard` is the time of arrival. */
  insert(parentName, childName, seconds, transform, isStatic = false, heard = 0) {
    const parent = plainName(parentName);
    const child = plainName(childName);
    if (parent === child) return `TF_SELF_TRANSFORM: the frame_id and child_frame_id "${child}" are the same`;
    if (!child || !parent) return "TF_NO_FRAME_ID: a transform without frame_id or child_frame_id";
    const { translation: t, rotation: r } = transform;
    const numbers = [t.x, t.y, t.z, r.x, r.y, r.z, r.w];
    if (!numbers.every(Number.isFinite))
      return `TF_NAN_INPUT: the transform of child_frame_id "${child}" has nan values`;
    if (Math.abs(r.x ** 2 + r.y ** 2 + r.z ** 2 + r.w ** 2 - 1) > QUATERNION_TOLERANCE) {
      return `TF_DENORMALIZED_QUATERNION: the rotation of child_frame_id "${child}" is not normalized`;
    }

    if (this.known.size >= MAX_FRAMES && !(this.known.has(parent) && this.known.has(child)))
      return `more than ${MAX_FRAMES} frames: "${child}" is left out`;

    this.version += 1;
    let edge = this.edges.get(child);
    if (!edge || edge.parent !== parent || edge.isStatic !== isStatic) {
      edge = { parent, isStatic, stamps: [], transforms: [], heard };
      this.edges.set(child, edge);
      this.known.add(parent).add(child);
      this.shape += 1;
    }
    edge.heard = heard;
    const value = { p: [t.x, t.y, t.z], q: normalized([r.x, r.y, r.z, r.w]) };
    if (isStatic) {
      edge.stamps = [seconds];
      edge.transforms = [value];
    } else record(edge, seconds, value);
    return "";
  }

  has(frame) {
    return this.known.has(plainName(frame));
  }

  names() {
    return [...this.known].sort();
  }

  /** Return a frame's parent, null for a root. */
  parent(frame) {
    return this.edges.get(frame)?.parent ?? null;
  }

  /** Return the frame at the top of this one's tree. Throws FrameError if the tree has a loop. */
  root(frame) {
    return this.chain(frame).at(-1);
  }

  /** Return the root that has most frames below it, "" without frames. */
  mainRoot() {
    const counts = new Map();
    for (const name of this.known) {
      let root;
      try {
        root = this.root(name);
      } catch {
        continue;
      }
      counts.set(root, (counts.get(root) ?? 0) + 1);
    }
    let found = "";
    for (const [name, count] of counts)
      if (!found || count > counts.get(found) || (count === counts.get(found) && name < found)) found = name;
    return found;
  }

  /**
   * Return the transform from `source` to `target` at a time in seconds; null is the newest that all frames between
   * have. Throws FrameError.
   */
  lookup(targetName, sourceName, seconds = null) {
    const target = plainName(targetName);
    const source = plainName(sourceName);
    if (target === source && (this.known.has(target) || !this.known.size)) return IDENTITY;
    for (const frame of [target, source]) {
      if (!this.known.has(frame)) throw new FrameError("unknown", t("Frame [{frame}] does not exist", { frame }));
    }

    const up = this.chain(source);
    const down = this.chain(target);
    const common = up.find((frame) => down.includes(frame));
    if (common === undefined) {
      throw new FrameError(
        "unconnected",
        `Could not find a connection between '${target}' and '${source}' because they are not part of the same tree. Tf has two or more unconnected trees.`,
      );
    }
    const sourceEdges = up.slice(0, up.indexOf(common)).map((frame) => this.edges.get(frame));
    const targetEdges = down.slice(0, down.indexOf(common)).map((frame) => this.edges.get(frame));
    const time = seconds ?? newestCommon([...sourceEdges, ...targetEdges]);

    const along = (edges) => edges.reduce((sum, edge) => compose(at(edge, time, source, target), sum), IDENTITY);
    const fromSource = along(sourceEdges);
    return targetEdges.length ? compose(invert(along(targetEdges)), fromSource) : fromSource;
  }

  /** Return a frame and all above it. */
  chain(frame) {
    const found = [frame];
    for (let name = this.parent(frame); name !== null; name = this.parent(name)) {
      if (found.length > MAX_DEPTH || name === frame)
        throw new FrameError("loop", "The tf tree is invalid because it contains a loop.");
      found.push(name);
    }
    return found;
  }
}

/** Return why a display that is in `frame` cannot be shown, in RViz's words. */
export function missingText(frame, fixedFrame, error) {
  return (
    t("No transform from [{frame}] to fixed frame [{fixed}]", { frame: plainName(frame), fixed: fixedFrame }) +
    (error ? `: ${error.message}` : "")
  );
}

function record(edge, seconds, value) {
  const { stamps, transforms } = edge;
  const newest = stamps.at(-1);
  // A bag that starts again, or a simulator: what is ahead of now says nothing any more.
  if (newest !== undefined && seconds < newest - CACHE_SECONDS) stamps.length = transforms.length = 0;
  if (!stamps.length || seconds > stamps.at(-1)) {
    stamps.push(seconds);
    transforms.push(value);
  } else {
    const index = firstFrom(stamps, seconds);
    if (stamps[index] === seconds) return;
    stamps.splice(index, 0, seconds);
    transforms.splice(index, 0, value);
  }
  const old = firstFrom(stamps, stamps.at(-1) - CACHE_SECONDS);
  // Not one by one: moving an array's rest is what costs.
  if (old > 200 || (old && old > stamps.length / 2)) {
    stamps.splice(0, old);
    transforms.splice(0, old);
  }
}

/** Return the index of the first stamp that is not before a time. */
function firstFrom(stamps, seconds) {
  let [low, high] = [0, stamps.length];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (stamps[middle] < seconds) low = middle + 1;
    else high = middle;
  }
  return low;
}

function newestCommon(edges) {
  let found = Infinity;
  for (const edge of edges) if (!edge.isStatic) found = Math.min(found, edge.stamps.at(-1));
  return found;
}

function at(edge, seconds, source, target) {
  const { stamps, transforms } = edge;
  if (edge.isStatic || seconds === Infinity) return transforms.at(-1);
  const index = firstFrom(stamps, seconds);
  if (stamps[index] === seconds) return transforms[index];
  if (index === 0 || index === stamps.length) {
    const [kind, word, bound] = index ? ["future", "latest", stamps.at(-1)] : ["past", "earliest", stamps[0]];
    throw new FrameError(
      kind,
      `Lookup would require extrapolation into the ${kind}.  Requested time ${seconds.toFixed(9)} but the ${word} data is at time ${bound.toFixed(9)}, when looking up transform from frame [${source}] to frame [${target}]`,
    );
  }
  return interpolate(
    transforms[index - 1],
    transforms[index],
    (seconds - stamps[index - 1]) / (stamps[index] - stamps[index - 1]),
  );
}
