// The shapes of a simulation at the poses of its links. All shapes come again when a model is added or removed. Those
// that have not changed stay, so that nothing flickers; those that are missing are removed.

import { DataTexture, DoubleSide } from "../../../vendor/three/three.min.js";
import { newSettings } from "../classes.js";
import { splitLink, topicOf } from "../../simulation.js";
import { t } from "../../texts.js";
import { bodyMaterial } from "../shapes.js";
import { Markers } from "./markers.js";

const DELETE_ALL = 3;
const MAX_PIXELS = 1024; // of a texture's side
const GLOW = 0x123468; // of what is selected
const [CUBE, SPHERE, CYLINDER, TRIANGLES] = [1, 2, 3, 11];
/** @type {any} */
const LINEAR = 1006; // three's LinearFilter

export class World extends Markers {
  /** `changed` is called when the shapes have changed. */
  constructor(context, changed) {
    super(context, newSettings("MarkerArray", topicOf("shapes")));
    this.whenChanged = changed;
  }

  start() {
    this.texts = new Map(); // "namespace/id" -> the marker as text
    this.links = new Set(); // frames of the simulation
    this.selected ??= "";
    super.start();
    this.ends.push(this.listen(topicOf("poses"), "latest", (message) => this.moved(message)));
  }

  received(message) {
    const kept = new Map();
    for (const marker of message.markers) {
      if (marker.action === DELETE_ALL) continue;
      kept.set(`${marker.ns}/${marker.id}`, { marker, text: identityOf(marker) });
    }
    for (const key of [...this.markers.keys()]) if (this.texts.get(key) !== kept.get(key)?.text) this.drop(key);
    const fresh = [...kept].filter(([key]) => !this.markers.has(key)).map(([, { marker }]) => marker);
    this.texts = new Map([...kept].map(([key, { text }]) => [key, text]));
    try {
      super.received({ markers: fresh });
    } finally {
      this.whenChanged();
    }
  }

  process(marker) {
    super.process(marker);
    const item = this.markers.get(`${marker.ns}/${marker.id}`)?.item;
    if (!item) return;
    item.object.userData.link = marker.ns;
    item.object.userData.isMoving = marker.frame_locked;
    if (marker.type === TRIANGLES && marker.colors.length) light(item.object);
    if (marker.text && [CUBE, SPHERE, CYLINDER].includes(marker.type)) this.paint(item.object, marker.text);
  }

  /** The poses of all links that can move; those that are not there any more are forgotten. */
  moved({ transforms }) {
    const { frames } = this.context;
    const links = new Set(transforms.map(({ child_frame_id: name }) => name));
    for (const name of this.links)
      if (!links.has(name)) {
        frames.edges.delete(name);
        frames.known.delete(name);
        frames.shape += 1;
      }
    this.links = links;
    // Static ones have no history: a pose replaces the one before, also after a reset of the time.
    const [refused] = frames.insertMessage({ transforms }, true, performance.now());
    if (refused) throw new Error(refused);
  }

  /** Cover a shape with a picture, as soon as it has come. */
  async paint(object, uri) {
    const { link, stage } = this.context;
    try {
      await stage.load(async () => {
        const texture = await loadTexture(link, uri);
        object.traverse((each) => {
          if (!each.isMesh) return;
          each.material.map = texture;
          each.material.color.setRGB(1, 1, 1);
          each.material.needsUpdate = true;
        });
      });
    } catch (error) {
      this.setStatus("Texture", 1, t("{name}: {why}", { name: uri, why: error.message }));
    }
  }

  /** Return {model, link, isMoving, point} of what is at a place of the picture, null if there is no model. */
  find(x, y) {
    const [hit] = this.context.stage.hits(x, y, [this.object]);
    let object = hit?.object;
    while (object && object.userData.link === undefined) object = object.parent;
    if (!object) return null;
    const { link, isMoving } = object.userData;
    return { model: splitLink(link)[0], link, isMoving, point: hit.point };
  }

  /** Return the names of the models that have shapes. */
  models() {
    return [...new Set([...this.markers.values()].map(({ space }) => splitLink(space)[0]))];
  }

  select(model) {
    this.selected = model;
    this.shine();
  }

  update() {
    super.update();
    this.shine();
  }

  /** Let the selected model shine, and no other one. */
  shine() {
    for (const [key, { item }] of this.markers) {
      const isSelected = Boolean(this.selected) && key.startsWith(`${this.selected}::`);
      if (Boolean(item.isSelected) === isSelected && !isSelected) continue;
      item.isSelected = isSelected;
      item.object.traverse((each) => {
        for (const material of [each.material ?? []].flat()) {
          const wanted = isSelected ? GLOW : (material.userData.emission ?? 0);
          if (!material.emissive || material.emissive.getHex() === wanted) continue;
          material.emissive.setHex(wanted);
          this.context.stage.invalidate();
        }
      });
    }
  }
}

/** Let light fall on triangles with colors of their own, which markers have none on. */
function light(object) {
  object.traverse((each) => {
    if (!each.isMesh) return;
    each.geometry.computeVertexNormals();
    each.material.dispose();
    each.material = bodyMaterial([255, 255, 255], each.material.opacity, { side: DoubleSide, vertexColors: true });
  });
}

/** Return a text that differs for markers that look different. */
function identityOf({ header, points, colors, ...rest }) {
  let sum = colors.length;
  points.forEach(({ x, y, z }, index) => {
    sum += (x + 2 * y + 3 * z) * ((index % 97) + 1);
  });
  return JSON.stringify([header.frame_id, points.length, sum, rest]);
}

async function loadTexture(link, uri) {
  const picture = await createImageBitmap(new Blob([await link.asset(uri)]));
  const scale = Math.min(1, MAX_PIXELS / Math.max(picture.width, picture.height));
  const [width, height] = [picture.width, picture.height].map((size) => Math.max(1, Math.round(size * scale)));
  const context = new OffscreenCanvas(width, height).getContext("2d");
  // The first row of a texture is its lowest one.
  context.setTransform(1, 0, 0, -1, 0, height);
  context.drawImage(picture, 0, 0, width, height);
  const texture = new DataTexture(new Uint8Array(context.getImageData(0, 0, width, height).data.buffer), width, height);
  texture.magFilter = texture.minFilter = LINEAR;
  texture.needsUpdate = true;
  return texture;
}
