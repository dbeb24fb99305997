// Text in the scene, as elements above the picture: sharp at every distance, and readable for people and tests.
// Of names that would cover each other, a few are stacked, and the others are hidden until the camera is nearer.

import { Vector3 } from "../../vendor/three/three.min.js";
import { h, setText } from "../dom.js";

const LINE = 15; // pixels
const MOST = 400;
const MAX_STACKED = 2; // lines that a name may be away from its place
const TEXT_SIZE = 0.91; // of RViz's letters: a marker's scale.z is more than their em

/**
 * Return how far down a name is at this place, so that it covers none of those that are there already; null if it
 * would be too far away.
 */
export function stacked(taken, x, y, width, line) {
  let top = y;
  // Half a pixel less than a line: sums of fractions are not exact.
  const covers = (other) => Math.abs(other.top - top) < line - 0.5 && x < other.x + other.width && other.x < x + width;
  for (let other = taken.find(covers); other; other = taken.find(covers)) {
    top = other.top + line;
    if (top > y + MAX_STACKED * line) return null;
  }
  taken.push({ x, top, width });
  return top;
}

export class Labels {
  constructor() {
    this.element = h("div", { class: "labels", "aria-hidden": "true" });
    this.all = new Set();
  }

  /**
   * Return a new label: its place is a Vector3 in the fixed frame; set isShown. Text has a height in metres, or none
   * for names.
   */
  add({ text, kind = "name", metres = null, color = null }) {
    const label = {
      text,
      metres,
      place: new Vector3(),
      isShown: false,
      span: h("span", { class: `label ${kind}` }, text),
      width: 0,
    };
    label.span.hidden = true;
    if (color) label.span.style.color = color;
    this.all.add(label);
    this.element.append(label.span);
    return label;
  }

  remove(label) {
    this.all.delete(label);
    label.span.remove();
  }

  change(label, text, color) {
    setText(label.span, text);
    label.width = 0;
    if (color) label.span.style.color = color;
  }

  /** Paint the labels over a picture that another camera has of the scene. */
  paint(context, camera, width, height) {
    const place = new Vector3();
    const taken = [];
    const line = LINE * devicePixelRatio;
    Object.assign(context, {
      globalAlpha: 1,
      textBaseline: "top",
      strokeStyle: "#000",
      lineWidth: 3 * devicePixelRatio,
      lineJoin: "round",
    });
    for (const label of this.all) {
      place.copy(label.place).project(camera);
      if (!label.isShown || !(Math.max(...place.toArray().map(Math.abs)) < 1)) continue;
      const [x, y] = [((place.x + 1) / 2) * width, ((1 - place.y) / 2) * height];
      const text = label.span.textContent;
      context.fillStyle = label.span.style.color || "#fff";
      if (label.metres === null) {
        context.font = `600 ${0.8 * line}px system-ui, sans-serif`;
        context.textAlign = "left";
        const top = stacked(taken, x, y, context.measureText(text).width, line);
        if (top === null) continue;
        context.strokeText(text, x, top);
        context.fillText(text, x, top);
      } else {
        const size =
          (TEXT_SIZE * label.metres * camera.projectionMatrix.elements[5] * height) /
          2 /
          camera.position.distanceTo(label.place);
        context.font = `${Math.min(300, Math.max(3, size))}px "Liberation Sans", Arial, sans-serif`;
        context.textAlign = "center";
        context.fillText(text, x, y - size / 2);
      }
    }
  }

  draw(stage) {
    const place = new Vector3();
    const taken = [];
    let count = 0;
    const found = [];
    for (const label of this.all) {
      place.copy(label.place).project(stage.camera);
      const isSeen =
        label.isShown && Math.abs(place.z) <= 1 && Math.abs(place.x) < 1.2 && Math.abs(place.y) < 1.2 && count < MOST;
      if (label.span.hidden === isSeen) label.span.hidden = !isSeen;
      if (!isSeen) continue;
      count += 1;
      found.push([label, ((place.x + 1) / 2) * stage.width, ((1 - place.y) / 2) * stage.height]);
    }
    // Widths first, then places: the browser lays the page out once.
    for (const [label] of found) label.width ||= label.span.offsetWidth || 1;
    for (const [label, x, y] of found) {
      let top = y;
      if (label.metres !== null) {
        const far = stage.view.kind === "top" ? 1 : stage.camera.position.distanceTo(label.place);
        label.span.style.fontSize = `${Math.min(300, Math.max(3, (TEXT_SIZE * label.metres * stage.pixelsPerMetre) / far))}px`;
      } else {
        const free = stacked(taken, x, top, label.width, LINE);
        label.span.style.visibility = free === null ? "hidden" : "";
        top = free ?? top;
      }
      label.span.style.transform = `translate(${x.toFixed(1)}px, ${top.toFixed(1)}px)`;
    }
  }
}
