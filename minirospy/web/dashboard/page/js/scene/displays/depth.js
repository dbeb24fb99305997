// A depth image as points, in the colors of another image if one is set.

import { pixelsOf } from "../../pixels.js";
import { lensOf, pointsOfDepth } from "../depth.js";
import { infoTopicOf } from "../projection.js";
import { secondsOf } from "../transforms.js";
import { t } from "../../texts.js";
import { Cloud } from "./cloud.js";

const sizeOf = ({ width, height }) => `${width}x${height}`;

export class DepthCloud extends Cloud {
  start() {
    this.info = null;
    this.colors = null; // {width, height, rgba, seconds} of the newest color image
    this.item = null; // of the newest depths
    super.start();
    if (!this.topic) return;
    const topic = infoTopicOf(this.topic);
    this.setStatus("Camera Info", 1, t("No CameraInfo received on [{topic}]. Topic may not exist.", { topic }));
    this.ends.push(
      this.listen(topic, "latest", (info) => {
        this.info = info;
        this.setStatus("Camera Info", 0, "OK");
        if (!this.items.size) this.show();
      }),
    );
    const colors = String(this.get("Color Image Topic") ?? "");
    this.isColored = colors !== "";
    if (!this.isColored) return;
    this.setStatus("Color Image", 1, t("No image received on [{topic}]", { topic: colors }));
    this.ends.push(
      this.listen(colors.startsWith("/") ? colors : `/${colors}`, "latest", (image) => {
        this.colors = { ...pixelsOf(image), seconds: secondsOf(image.header.stamp) };
        if (!this.items.size || (this.seconds === this.colors.seconds && this.coloredAt !== this.seconds)) this.show();
      }),
    );
  }

  received(message) {
    this.message = message;
    this.seconds = secondsOf(message.header.stamp);
    this.item = null;
    this.show();
  }

  /**
   * Show the newest depths, once all is there: in the colors of the same moment where those come, else in the newest.
   */
  show() {
    const { message, info, colors, isColored } = this;
    if (!message || !info || (isColored && !colors)) return;
    if (isColored) {
      if (colors.width !== message.width || colors.height !== message.height) {
        this.setStatus(
          "Color Image",
          2,
          t("Depth image resolution ({depth}) does not match color image resolution ({color})", {
            depth: sizeOf(message),
            color: sizeOf(colors),
          }),
        );
        return;
      }
      this.setStatus("Color Image", 0, "OK");
      this.coloredAt = colors.seconds;
    }
    // The same depths in other colors.
    if (this.items.has(this.item)) this.remove(this.item);
    super.received(message);
    this.item = [...this.items].at(-1);
  }

  changed(path) {
    if (/Topic$/.test(path) || !this.items.size) this.restart();
    else super.changed(path);
  }

  // --- for Cloud

  pointsOf(message, settings, stride) {
    this.lens = lensOf(this.info, message);
    return pointsOfDepth(message, this.lens, this.colors?.rgba, stride);
  }

  namesOf() {
    return this.isColored ? ["rgb"] : [];
  }

  /** Return the size of a point in metres, or at a depth of one metre: there a pixel is as large. */
  sizeOf() {
    if (this.get("Auto Size") === false) return super.sizeOf();
    return { size: this.number("Auto Size/Auto Size Factor", 1) / this.lens.fx, grows: true };
  }
}
