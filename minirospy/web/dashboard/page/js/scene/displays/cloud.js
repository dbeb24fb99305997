// Scans and clouds: points colored by intensity, axis, or their own colors; older ones stay for the decay time.

import {
  colorsOf,
  pointsOfCloud,
  pointsOfOldCloud,
  pointsOfScan,
  suitableTransformer,
  wantedChannels,
} from "../points.js";
import { points, solids } from "../shapes.js";
import { t } from "../../texts.js";
import { IDENTITY } from "../transforms.js";
import { TopicDisplay } from "./display.js";

const MAX_SCANS = 1000;
const MAX_BOXES = 50_000; // of one message

export class Cloud extends TopicDisplay {
  changed(path) {
    if (/Topic$/.test(path) || !this.message) this.restart();
    else {
      for (const item of [...this.items]) this.remove(item);
      this.draw(this.message);
    }
  }

  start() {
    this.message = null;
    super.start();
  }

  received(message) {
    this.message = message;
    const decay = this.number("Decay Time");
    if (decay <= 0) for (const item of [...this.items]) this.remove(item);
    this.draw(message);
    this.keep(MAX_SCANS);
  }

  draw(message) {
    const total = message.ranges ? 0 : (message.width ?? 0) * (message.height ?? 0);
    // Of a cloud that is too large every second, third, ... point.
    const stride = Math.max(1, Math.ceil(total / this.context.stage.mostPoints));
    const settings = this.colored(message);
    const found = this.pointsOf(message, settings, stride);
    const { frame_id: frame } = message.header;
    const colors = colorsOf(found, settings, this.context.transformNow(frame) ?? IDENTITY);

    const isPixels = settings.Style === "Points";
    const { size, grows } = isPixels ? { size: this.number("Size (Pixels)", 3) } : this.sizeOf();
    const paint = {
      rgb: settings["Color Transformer"] === "FlatColor" ? this.color() : [255, 255, 255],
      alpha: this.number("Alpha", 1),
    };
    // Boxes are 36 corners each: of very many a square is drawn.
    const object =
      settings.Style === "Boxes" && found.count <= MAX_BOXES && !grows
        ? solids(found.positions, colors, { ...paint, size: [size, size, size] })
        : points(found.positions, colors, {
            ...paint,
            size,
            isMetres: !isPixels,
            grows,
            isRound: settings.Style === "Spheres",
          });
    const item = this.addAt(message.header, object);
    item.until = performance.now() + this.number("Decay Time") * 1000;
    this.setStatus(
      "Points",
      stride > 1 ? 1 : 0,
      stride > 1
        ? t(
            this.context.stage.isSoftware
              ? "Showing {count} points of {all}: one of {stride}, for this software renderer"
              : "Showing {count} points of {all}: one of {stride}, for this browser",
            { count: found.count, all: total, stride },
          )
        : t("Showing {count} points from {all}", {
            count: found.count,
            all: message.ranges ? message.ranges.length : found.total,
          }),
    );
  }

  pointsOf(message, settings, stride) {
    if (message.ranges) return pointsOfScan(message);
    return message.point_step === undefined
      ? pointsOfOldCloud(message)
      : pointsOfCloud(message, wantedChannels(settings), stride);
  }

  namesOf(message) {
    return message.ranges ? ["intensity"] : (message.fields ?? message.channels).map(({ name }) => name);
  }

  /** Return the size of a point in metres; `grows`: with its depth, which is its z. */
  sizeOf() {
    return { size: this.number("Size (m)", 0.01), grows: false };
  }

  /** Return the settings with a transformer, if none is set that which suits the message's fields. */
  colored(message) {
    const names = this.namesOf(message);
    if (!this.get("Color Transformer")) this.settings["Color Transformer"] = suitableTransformer(names);
    const settings = { ...this.settings };
    const isThere =
      !(message.ranges && !message.intensities.length) && wantedChannels(settings).some((name) => names.includes(name));
    // What RViz shows in white: without the field that the colors come from.
    if (!isThere && settings["Color Transformer"] !== "AxisColor") settings["Color Transformer"] = "FlatColor";
    return settings;
  }

  update() {
    const decay = this.number("Decay Time");
    if (decay > 0) {
      const now = performance.now();
      const items = [...this.items];
      // The newest stays until another comes.
      for (const item of items.slice(0, -1)) if (item.until < now) this.remove(item);
    }
    super.update();
  }
}
