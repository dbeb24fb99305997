// What displays share: frames, the fixed frame, and where in the picture the things of a frame and time are.

import { t } from "../texts.js";
import { FrameError, Frames, IDENTITY, plainName } from "./transforms.js";

const USUAL_FIXED = ["map", "odom", "world"];
const LOOK_MS = 200; // between two updates while no frame moves: lifetimes, decays

export class Context {
  constructor(link, stage, statusChanged) {
    this.link = link;
    this.stage = stage;
    this.statusChanged = statusChanged;
    this.frames = new Frames();
    this.fixedFrame = "map";
    this.fixedVersion = 0;
    this.chosenFrame = ""; // "" is automatic
    this.messageFrame = "";
    this.refused = "";
    this.seen = -1;
    this.isFresh = true;
    this.isInteracting = true; // with interactive markers
    this.lastLook = 0;
    this.lastTime = null;
    const listen = (topic, isStatic) =>
      link.subscribe({ topic, mode: "all", isOwn: true }, ({ lines = [], error }) => {
        if (error) this.refused = `${topic}: ${error}`;
        const now = performance.now();
        for (const { message } of lines)
          this.refused = this.frames.insertMessage(message, isStatic, now)[0] ?? this.refused;
      });
    this.ends = [listen("/tf", false), listen("/tf_static", true), link.watch(["time"], () => this.timed())];
  }

  close() {
    for (const end of this.ends) end();
  }

  /** Simulated time that goes back: a bag or a simulation starts again. */
  timed() {
    const { time } = this.link;
    if (time !== null && this.lastTime !== null && time < this.lastTime - 1) {
      const fixed = [...this.frames.edges].filter(([, { isStatic }]) => isStatic);
      this.frames.clear();
      for (const [child, edge] of fixed) {
        this.frames.edges.set(child, edge);
        this.frames.known.add(child).add(edge.parent);
      }
      this.fixedVersion += 1;
    }
    this.lastTime = time;
  }

  /** Return the time in ROS's form: that of /clock if it is simulated. */
  stamp() {
    const seconds = this.link.time ?? Date.now() / 1000;
    const secs = Math.floor(seconds);
    return { secs, nsecs: Math.floor((seconds - secs) * 1e9) };
  }

  // --- the fixed frame

  chooseFixed(name) {
    this.chosenFrame = plainName(name);
    this.resolveFixed();
  }

  resolveFixed() {
    const { frames } = this;
    const automatic = () =>
      USUAL_FIXED.find((name) => frames.has(name)) ?? (frames.mainRoot() || this.messageFrame || "map");
    const found = this.chosenFrame || automatic();
    if (found === this.fixedFrame) return;
    this.fixedFrame = found;
    this.fixedVersion += 1;
    this.statusChanged();
    this.stage.invalidate();
  }

  /** Return [level, text] of the fixed frame. */
  fixedStatus() {
    if (this.frames.has(this.fixedFrame)) return this.refused ? [1, this.refused] : [0, "OK"];
    if (!this.frames.known.size)
      return [1, t("No tf data.  Actual error: Fixed Frame [{frame}] does not exist", { frame: this.fixedFrame })];
    return [2, t("Fixed Frame [{frame}] does not exist", { frame: this.fixedFrame })];
  }

  // --- placing

  /** Return the newest transform from a frame to the fixed frame, null if there is none. */
  transformNow(frame) {
    if (plainName(frame) === this.fixedFrame) return IDENTITY;
    try {
      return this.frames.lookup(this.fixedFrame, frame);
    } catch {
      return null;
    }
  }

  /** Put an item where its frame was at its time, or is; hide it and set its error if there is no transform. */
  place(item) {
    if (item.settled === this.fixedVersion && !item.isLocked) return;
    let found = IDENTITY;
    let isSettled = true;
    try {
      if (plainName(item.frame) !== this.fixedFrame) [found, isSettled] = this.find(item);
    } catch (error) {
      if (!(error instanceof FrameError)) throw error;
      item.error = error;
      if (item.object.visible) this.stage.invalidate();
      item.object.visible = false;
      return;
    }
    item.error = null;
    if (isSettled) item.settled = this.fixedVersion;
    this.put(item, found);
  }

  find({ frame, seconds, isLocked }) {
    if (isLocked || !seconds) return [this.frames.lookup(this.fixedFrame, frame), true];
    try {
      return [this.frames.lookup(this.fixedFrame, frame, seconds), true];
    } catch (error) {
      // Its transform comes soon, or was forgotten: meanwhile at the newest one.
      if (error.kind === "future" || error.kind === "past") return [this.frames.lookup(this.fixedFrame, frame), false];
      throw error;
    }
  }

  put(item, { p, q }) {
    const { object } = item;
    const { position, quaternion } = object;
    const isSame =
      object.visible &&
      Math.abs(position.x - p[0]) + Math.abs(position.y - p[1]) + Math.abs(position.z - p[2]) < 1e-7 &&
      Math.abs(quaternion.x * q[0] + quaternion.y * q[1] + quaternion.z * q[2] + quaternion.w * q[3]) > 1 - 1e-12;
    if (isSame && !item.follow) return;
    object.visible = true;
    position.set(...p);
    quaternion.set(...q);
    if (item.follow) {
      object.updateMatrix();
      item.follow(object.matrix);
    }
    if (!isSame) this.stage.invalidate();
  }

  /** A display has something new. */
  received(display) {
    if (!this.messageFrame) this.messageFrame = plainName(display.items.values().next().value?.frame ?? "");
    this.isFresh = true;
  }

  /** Update the displays if something may have changed. */
  tick(displays) {
    const now = performance.now();
    if (!this.isFresh && this.frames.version === this.seen && now - this.lastLook < LOOK_MS) return;
    this.isFresh = false;
    this.seen = this.frames.version;
    this.lastLook = now;
    this.resolveFixed();
    for (const display of displays) display.update();
    const { target } = this.stage.view;
    const base = target && target !== "<Fixed Frame>" ? this.transformNow(target) : IDENTITY;
    if (base) this.stage.setBase(base);
  }
}
