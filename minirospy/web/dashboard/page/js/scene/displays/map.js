// Maps: one texture of the cells' bytes, colored by a palette when they are drawn.

import {
  DataTexture,
  DoubleSide,
  Group,
  Mesh,
  NearestFilter,
  PlaneGeometry,
  RedFormat,
  RGBAFormat,
  ShaderMaterial,
  UnsignedByteType,
} from "../../../vendor/three/three.min.js";
import { palette } from "../colors.js";
import { fromMessage } from "../transforms.js";
import { t } from "../../texts.js";
import { TopicDisplay } from "./display.js";

const VERTEX =
  "varying vec2 at; void main() { at = uv; gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }";
const FRAGMENT = `
uniform sampler2D cells; uniform sampler2D colors; uniform float opacity; varying vec2 at;
void main() {
  float value = texture2D(cells, at).r;
  vec4 color = texture2D(colors, vec2((value * 255.0 + 0.5) / 256.0, 0.5));
  if (color.a < 0.01) discard;
  gl_FragColor = vec4(color.rgb, color.a * opacity);
}`;

/** Return the cells as one byte each, every `step`-th of a row and column. */
export function thinned({ info, data }, step) {
  const [width, height] = [Math.ceil(info.width / step), Math.ceil(info.height / step)];
  if (step === 1) return { width, height, cells: new Uint8Array(data.buffer, data.byteOffset, data.length) };
  const cells = new Uint8Array(width * height);
  for (let row = 0; row < height; row++)
    for (let column = 0; column < width; column++)
      cells[row * width + column] = data[row * step * info.width + column * step];
  return { width, height, cells };
}

export class MapDisplay extends TopicDisplay {
  start() {
    super.start();
    this.map = null;
    if (this.topic) this.ends.push(this.listen(`${this.topic}_updates`, "all", (update) => this.updated(update)));
  }

  changed(path) {
    if (path === "Topic" || !this.map) this.restart();
    else this.draw();
  }

  received(message) {
    const { width, height } = message.info;
    // Positions in a grid of no cells, or of others than it says, are nowhere.
    if (message.data.length !== width * height)
      throw new Error(
        t("Data size doesn't match width*height: width = {width}, height = {height}, data size = {size}", {
          width,
          height,
          size: message.data.length,
        }),
      );
    if (!width || !height) throw new Error(t("Map is zero-sized ({width}x{height})", { width, height }));
    this.map = message;
    this.draw();
  }

  updated({ x, y, width, height, data }) {
    if (!this.map || data.length === undefined) return;
    const { info, data: cells } = this.map;
    if (x < 0 || y < 0 || x + width > info.width || y + height > info.height)
      throw new Error(t("Update area outside of original map area."));
    for (let row = 0; row < height; row++)
      cells.set(data.subarray(row * width, (row + 1) * width), (y + row) * info.width + x);
    this.draw();
  }

  draw() {
    for (const item of [...this.items]) this.remove(item);
    const { info, header } = this.map;
    const most = this.context.stage.renderer.capabilities.maxTextureSize;
    const step = Math.ceil(Math.max(info.width, info.height) / most);
    const { width, height, cells } = thinned(this.map, step);
    const texture = new DataTexture(cells, width, height, RedFormat, UnsignedByteType);
    Object.assign(texture, {
      magFilter: NearestFilter,
      minFilter: NearestFilter,
      unpackAlignment: 1,
      needsUpdate: true,
    });
    const colors = new DataTexture(palette(this.get("Color Scheme")), 256, 1, RGBAFormat, UnsignedByteType);
    Object.assign(colors, { magFilter: NearestFilter, minFilter: NearestFilter, needsUpdate: true });

    const [across, along] = [info.width * info.resolution, info.height * info.resolution];
    const material = new ShaderMaterial({
      vertexShader: VERTEX,
      fragmentShader: FRAGMENT,
      transparent: true,
      depthWrite: false,
      side: DoubleSide,
      // What is drawn on the map is above it.
      polygonOffset: true,
      polygonOffsetFactor: 2,
      polygonOffsetUnits: 16,
      uniforms: { cells: { value: texture }, colors: { value: colors }, opacity: { value: this.number("Alpha", 0.7) } },
    });
    material.addEventListener("dispose", () => [texture, colors].forEach((each) => each.dispose()));
    const plane = new Mesh(
      new PlaneGeometry(across, along).translate(across / 2, along / 2, this.get("Draw Behind") ? -0.005 : 0),
      material,
    );
    plane.renderOrder = this.get("Draw Behind") ? -2 : -1;
    const { p, q } = fromMessage(info.origin);
    plane.position.fromArray(p);
    plane.quaternion.fromArray(q);
    const group = new Group();
    group.add(plane);
    // A map stays where its frame is.
    this.add(group, header.frame_id, 0, true);
    this.setStatus(
      "Map",
      step > 1 ? 1 : 0,
      t("{width} x {height} cells of {size} m", {
        width: info.width,
        height: info.height,
        size: Number(info.resolution.toFixed(4)),
      }) + (step > 1 ? t(", one of {step} is shown", { step }) : ""),
    );
  }
}
