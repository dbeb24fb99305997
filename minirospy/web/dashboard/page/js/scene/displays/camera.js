// The scene as a camera sees it, in and over its picture: in a corner of the view, large after a click.
// Source: http://wiki.ros.org/rviz/DisplayTypes/Camera, sensor_msgs/CameraInfo.

import {
  DataTexture,
  Group,
  PerspectiveCamera,
  Quaternion,
  RGBAFormat,
  UnsignedByteType,
  Vector3,
} from "../../../vendor/three/three.min.js";
import { h } from "../../dom.js";
import { pixelsOf } from "../../pixels.js";
import { t } from "../../texts.js";
import { infoTopicOf, projectionOf } from "../projection.js";
import { TopicDisplay } from "./display.js";

// From a camera's axes (z forward, y down) to those of pictures (z backward, y up).
const TURNED = new Quaternion(1, 0, 0, 0);

export class Camera extends TopicDisplay {
  start() {
    this.camera = new PerspectiveCamera();
    this.info = null;
    this.texture = null;
    this.picture = document.createElement("canvas");
    this.canvas = h("canvas", {
      class: "inset",
      hidden: true,
      title: "click: larger or smaller",
      onclick: () => this.enlarge(),
    });
    super.start();
    if (!this.topic) return;
    this.canvas.setAttribute("aria-label", this.topic);
    this.context.stage.addInset(this);
    const topic = infoTopicOf(this.topic);
    this.setStatus("Camera Info", 1, t("No CameraInfo received on [{topic}]. Topic may not exist.", { topic }));
    this.ends.push(
      this.listen(topic, "latest", (info) => this.informed(info)),
      () => this.context.stage.removeInset(this),
      () => this.texture?.dispose(),
    );
  }

  changed(path) {
    if (path === "Image Topic") this.restart();
    else if (this.info) this.informed(this.info);
    this.context.stage.invalidate();
  }

  informed(info) {
    const { matrix, offset } = projectionOf(info, this.number("Zoom Factor", 1));
    this.info = info;
    this.camera.projectionMatrix.fromArray(matrix);
    this.camera.projectionMatrixInverse.copy(this.camera.projectionMatrix).invert();
    this.offset = offset;
    this.setStatus("Camera Info", 0, "OK");
    this.context.stage.invalidate();
  }

  received(message) {
    const { width, height, rgba } = pixelsOf(message);
    const most = this.context.stage.renderer.capabilities.maxTextureSize;
    if (!width || !height || Math.max(width, height) > most)
      throw new Error(t("an image of {width} x {height} cannot be shown here", { width, height }));
    if (this.picture.width !== width || this.picture.height !== height) {
      Object.assign(this.picture, { width, height });
      this.texture?.dispose();
      this.texture = null;
    }
    this.picture.getContext("2d").putImageData(new ImageData(rgba, width, height), 0, 0);
    if (this.texture) this.texture.image.data = rgba;
    else this.texture = new DataTexture(rgba, width, height, RGBAFormat, UnsignedByteType);
    Object.assign(this.texture, { flipY: true, needsUpdate: true });
    this.keep(1);
    const old = [...this.items];
    this.addAt(message.header, new Group());
    for (const item of old) this.remove(item);
  }

  enlarge() {
    this.canvas.classList.toggle("large");
    this.context.stage.invalidate();
  }

  // --- what the stage draws

  /** Return the camera once all is known that it needs, null before. */
  aim() {
    const [item] = this.items;
    const { camera } = this;
    if (!item?.object.visible || !this.info || !this.texture) return null;
    const { position, quaternion } = item.object;
    camera.position.copy(position).add(new Vector3(...this.offset).applyQuaternion(quaternion));
    camera.quaternion.copy(quaternion).multiply(TURNED);
    camera.updateMatrixWorld();
    return camera;
  }

  get background() {
    return this.get("Image Rendering") === "overlay" ? null : this.texture;
  }

  /** Copy the drawing, a part of the stage's canvas, and lay the picture over it. */
  show(drawing, left, top, width, height) {
    Object.assign(this.canvas, { width, height });
    const context = this.canvas.getContext("2d");
    context.drawImage(drawing, left, top, width, height, 0, 0, width, height);
    if (this.get("Image Rendering") !== "background") {
      context.globalAlpha = Math.min(1, Math.max(0, this.number("Overlay Alpha", 0.5)));
      const zoom = Math.max(0.01, this.number("Zoom Factor", 1));
      context.drawImage(this.picture, (width * (1 - zoom)) / 2, (height * (1 - zoom)) / 2, width * zoom, height * zoom);
    }
    this.context.stage.labels.paint(context, this.camera, width, height);
  }
}
