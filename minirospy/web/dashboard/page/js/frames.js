// The tree of frames as /tf and /tf_static have it: parents, rates, ages, and what is wrong with it. Pure.
// Source: http://wiki.ros.org/tf2/Design.

import { Rate } from "./rates.js";
import { t } from "./texts.js";

const CONFLICT_SECONDS = 3; // in which a frame has two parents
const LEAST_AGE = 1; // seconds, under which no frame is old
const OLD_PERIODS = 10;
export const MAX_FRAMES = 2000;
const MAX_PARENTS = 20; // of a frame, the latest

export class Frames {
  constructor() {
    // child -> {child, parent, isStatic, transform, stamp, at, rate, parents: Map of parent -> time}
    this.frames = new Map();
  }

  /** Take over a message of /tf or /tf_static that came at ``at`` (seconds of the page's clock, which never jumps). */
  add(message, at, isStatic) {
    for (const { header, child_frame_id: childId, transform } of message.transforms) {
      const [parent, child] = [plain(header.frame_id), plain(childId)];
      let frame = this.frames.get(child);
      if (!frame) {
        if (this.frames.size >= MAX_FRAMES) continue;
        frame = { child, rate: new Rate(), parents: new Map() };
        this.frames.set(child, frame);
      }
      frame.parents.delete(parent);
      frame.parents.set(parent, at);
      if (frame.parents.size > MAX_PARENTS) frame.parents.delete(frame.parents.keys().next().value);
      frame.rate.add(at, 1, 0);
      Object.assign(frame, { parent, isStatic, transform, stamp: header.stamp.secs + header.stamp.nsecs * 1e-9, at });
    }
  }

  clear() {
    this.frames.clear();
  }

  /** Return the names of all frames, parents that nobody describes too. */
  names() {
    return [...new Set([...this.frames.values()].flatMap(({ parent, child }) => [parent, child]))].sort();
  }

  /** Return the frames without a parent. */
  roots() {
    return this.names().filter((name) => !this.frames.has(name));
  }

  /** Return what is known of a frame at a time: {hz, age}, hz null if it is not known; static ones have neither. */
  measured(name, now) {
    const frame = this.frames.get(name);
    if (!frame || frame.isStatic) return { hz: null, age: null };
    return { hz: frame.rate.at(now)?.hz ?? null, age: now - frame.at };
  }

  /** Return what is wrong with a frame and what to do, "" if nothing is. */
  problem(name, now) {
    const frame = this.frames.get(name);
    if (!frame) return "";
    const parents = [...frame.parents]
      .filter(([, at]) => frame.isStatic || now - at < CONFLICT_SECONDS)
      .map(([parent]) => parent);
    if (parents.length > 1)
      return t("It has {count} parents, {names}: let one node alone publish it.", {
        count: parents.length,
        names: parents.sort().join(t(" and ")),
      });
    if (this.isCycle(name)) return t("It is its own ancestor: no transform through it can be computed.");
    if (frame.isStatic) return "";
    const { age } = this.measured(name, now);
    // By the rate that it had: three seconds after its last message that is no longer measured.
    const limit = Math.max(LEAST_AGE, frame.usualHz ? OLD_PERIODS / frame.usualHz : 0);
    return age > limit
      ? t("No transform for {age} s: its publisher has stopped, or is slow.", { age: age.toFixed(age < 10 ? 1 : 0) })
      : "";
  }

  /** Remember the rates, by which frames are found to be old. */
  remember(now) {
    for (const frame of this.frames.values()) {
      const hz = frame.rate.at(now)?.hz;
      if (hz) frame.usualHz = hz;
    }
  }

  isCycle(name) {
    const seen = new Set();
    let at = name;
    while (this.frames.has(at) && !seen.has(at)) {
      seen.add(at);
      at = this.frames.get(at).parent;
    }
    return at === name;
  }
}

/** Return roll, pitch and yaw (radians) of a quaternion, as tf.transformations' euler_from_quaternion. */
export function eulerOf({ x, y, z, w }) {
  const roll = Math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y));
  const pitch = Math.asin(Math.min(1, Math.max(-1, 2 * (w * y - z * x))));
  const yaw = Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));
  return [roll, pitch, yaw];
}

// tf allowed a slash in front, tf2 removes it.
function plain(name) {
  return name.startsWith("/") ? name.slice(1) : name;
}
