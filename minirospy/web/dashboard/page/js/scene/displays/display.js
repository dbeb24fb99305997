// What all displays have in common: settings, a status, subscriptions, and objects at the frames of their messages.

import { Group } from "../../../vendor/three/three.min.js";
import { CLASSES, classOf, getSetting } from "../classes.js";
import { rgbOf } from "../colors.js";
import { discard, fade } from "../shapes.js";
import { missingText, secondsOf } from "../transforms.js";
import { t } from "../../texts.js";

export const LEVELS = ["ok", "warn", "error"];

/**
 * One display. The context: {link, stage, frames, fixedFrame, place(item), transformNow(frame), time(),
 * statusChanged()}.
 */
export class Display {
  constructor(context, settings) {
    this.context = context;
    this.settings = settings;
    this.object = new Group();
    this.items = new Set();
    this.status = new Map(); // name -> [level, text]
    context.stage.scene.add(this.object);
    this.start();
  }

  start() {}

  /** A setting has another value. */
  changed() {
    this.restart();
  }

  restart() {
    this.stop();
    this.start();
  }

  stop() {
    for (const item of [...this.items]) this.remove(item);
    this.status.clear();
    this.context.stage.invalidate();
  }

  close() {
    this.stop();
    discard(this.object);
  }

  get(path) {
    return getSetting(this.settings, path);
  }

  number(path, usual = 0) {
    const value = Number(this.get(path));
    return Number.isFinite(value) ? value : usual;
  }

  color(path = "Color") {
    return rgbOf(this.get(path));
  }

  setStatus(name, level, text) {
    const old = this.status.get(name);
    if (old?.[0] === level && old[1] === text) return;
    this.status.set(name, [level, text]);
    this.context.statusChanged();
  }

  clearStatus(name) {
    if (this.status.delete(name)) this.context.statusChanged();
  }

  /** Return the worst level. */
  level() {
    return Math.max(0, ...[...this.status.values()].map(([level]) => level));
  }

  /** Show an object at a frame: of a time in seconds, or (isLocked) wherever the frame is. */
  add(object, frame, seconds, isLocked = false) {
    const item = { object, frame, seconds, isLocked, settled: -1, error: null };
    object.visible = false;
    this.object.add(object);
    this.items.add(item);
    this.context.place(item);
    this.context.stage.invalidate();
    return item;
  }

  remove(item) {
    this.items.delete(item);
    discard(item.object, (material) => this.context.stage.release(material));
    this.context.stage.invalidate();
  }

  /** Put what is shown to its place; called before each picture whose frames have moved. */
  update() {
    let failed = null;
    for (const item of this.items) {
      this.context.place(item);
      if (item.error) failed = item;
    }
    this.showTransform(failed);
  }

  showTransform(failed) {
    if (failed) this.setStatus("Transform", 2, missingText(failed.frame, this.context.fixedFrame, failed.error));
    else if (this.items.size) this.setStatus("Transform", 0, t("Transform OK"));
  }
}

/** A display of one topic; `received(message)` shows a message. */
export class TopicDisplay extends Display {
  /** How messages come: "latest" if only the newest counts, "all" if each does. */
  get mode() {
    return "latest";
  }

  /** Show a message. */
  received(_message) {
    throw new TypeError(`${this.constructor.name} does not show messages`);
  }

  start() {
    const { types, topicKey = "Topic" } = CLASSES[classOf(this.settings)];
    this.types = types;
    const name = String(this.get(topicKey) ?? "");
    this.topic = name && !name.startsWith("/") ? `/${name}` : name;
    this.count = 0;
    this.isGone = false; // there were messages, and nothing publishes them now
    if (!this.topic) {
      this.setStatus("Topic", 1, t("No topic is set"));
      return;
    }
    this.ends = [
      this.listen(this.topic, this.mode, (message) => {
        this.count += 1;
        this.received(message);
        this.setStatus("Topic", 0, t("Messages received"));
      }),
    ];
    this.setStatus("Topic", 1, t("No messages received"));
    this.ends.push(this.context.link.watch(["channels"], () => this.checkType()));
  }

  /** Subscribe to a topic; return what ends it. What a message raises is the status of the display. */
  listen(topic, mode, receive) {
    const handle = (message) => {
      try {
        receive(message);
        this.clearStatus("Message");
      } catch (error) {
        this.setStatus("Message", 2, error.message);
      }
      this.context.received(this);
    };
    return this.context.link.subscribe({ topic, mode, isOwn: mode === "all" }, ({ message, lines, error }) => {
      if (error) this.setStatus("Message", 2, error);
      if (this.isWrong) return;
      if (lines) for (const line of lines) handle(line.message);
      else if (message) handle(message);
    });
  }

  checkType() {
    const channel = this.context.link.channels.get(this.topic);
    this.type = channel?.type;
    this.isWrong = Boolean(channel) && !this.types.includes(channel.type);
    if (this.isWrong)
      this.setStatus(
        "Topic",
        2,
        t("{topic} has the type {type}, not {wanted}", {
          topic: this.topic,
          type: channel.type,
          wanted: this.types[0],
        }),
      );
    else if (!this.count) this.setStatus("Topic", 1, t("No messages received"));
    else {
      const isGone = !channel;
      this.setStatus(
        "Topic",
        isGone ? 1 : 0,
        isGone ? t("Nothing publishes this topic any more") : t("Messages received"),
      );
      if (isGone !== this.isGone) {
        this.isGone = isGone;
        fade(this.object, isGone);
        this.context.stage.invalidate();
      }
    }
  }

  stop() {
    for (const end of this.ends ?? []) end();
    this.ends = [];
    super.stop();
  }

  /** Show an object at the frame and time of a header. */
  addAt(header, object) {
    return this.add(object, header.frame_id, secondsOf(header.stamp));
  }

  /** Keep so many of the newest items. */
  keep(most) {
    while (this.items.size > Math.max(1, most)) this.remove(this.items.values().next().value);
  }
}
