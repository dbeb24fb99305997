// A drawing in an SVG that is moved by dragging, and zoomed by the wheel or two fingers.

import { SLOP } from "./dom.js";

export class PanZoom {
  /** ``picture`` is the svg, ``drawing`` the g in it; ``label`` names it for screen readers. */
  constructor(picture, drawing) {
    this.picture = picture;
    this.drawing = drawing;
    this.size = null;
    this.view = { x: 0, y: 0, scale: 1 };
    this.isFitted = true;
    this.pointers = new Map();
    this.pressedAt = null;
    this.isDragged = false;
    this.listen();
    this.observer = new ResizeObserver(() => {
      if (this.isFitted) this.fit();
    });
    this.observer.observe(picture);
  }

  close() {
    this.observer.disconnect();
  }

  /** Take over the size of a new drawing; show all of it, unless a person has moved it. */
  resized(width, height) {
    this.size = { width: Number.isFinite(width) ? width : 1, height: Number.isFinite(height) ? height : 1 };
    if (this.isFitted) this.fit();
  }

  fit() {
    this.isFitted = true;
    const { clientWidth, clientHeight } = this.picture;
    if (!this.size || !clientWidth) return;
    const scale = Math.min(1.4, clientWidth / this.size.width, clientHeight / this.size.height);
    this.view = {
      scale,
      x: (clientWidth - this.size.width * scale) / 2,
      y: (clientHeight - this.size.height * scale) / 2,
    };
    this.move();
  }

  move() {
    const { x, y, scale } = this.view;
    this.drawing.setAttribute("transform", `translate(${x.toFixed(2)} ${y.toFixed(2)}) scale(${scale.toFixed(4)})`);
  }

  zoom(factor, x, y) {
    const scale = Math.min(4, Math.max(0.05, this.view.scale * factor));
    const real = scale / this.view.scale;
    this.view = { scale, x: x - (x - this.view.x) * real, y: y - (y - this.view.y) * real };
    this.isFitted = false;
    this.move();
  }

  listen() {
    this.picture.addEventListener(
      "wheel",
      (event) => {
        event.preventDefault();
        const box = this.picture.getBoundingClientRect();
        this.zoom(Math.exp(-event.deltaY * 0.0015), event.clientX - box.left, event.clientY - box.top);
      },
      { passive: false },
    );
    this.picture.addEventListener("pointerdown", (event) => {
      this.pointers.set(event.pointerId, event);
      this.pressedAt = event;
      this.isDragged = this.pointers.size > 1;
    });
    // What the drawing was dragged by is not clicked.
    this.picture.addEventListener(
      "click",
      (event) => {
        if (this.isDragged && event.isTrusted && event.detail) event.stopPropagation();
        this.isDragged = false;
      },
      true,
    );
    this.picture.addEventListener("pointermove", (event) => this.moved(event));
    for (const name of ["pointerup", "pointercancel", "pointerleave"])
      this.picture.addEventListener(name, (event) => this.pointers.delete(event.pointerId));
  }

  moved(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    if (this.pointers.size === 2) {
      const other = [...this.pointers.values()].find((each) => each.pointerId !== event.pointerId);
      const distance = (each) => Math.hypot(each.clientX - other.clientX, each.clientY - other.clientY);
      const box = this.picture.getBoundingClientRect();
      this.zoom(
        distance(event) / Math.max(1, distance(before)),
        (event.clientX + other.clientX) / 2 - box.left,
        (event.clientY + other.clientY) / 2 - box.top,
      );
    } else if (this.pointers.size === 1) {
      // The hand moves a little in a click, too.
      this.isDragged ||=
        Math.hypot(event.clientX - this.pressedAt.clientX, event.clientY - this.pressedAt.clientY) > SLOP;
      if (!this.isDragged) return;
      this.view.x += event.clientX - before.clientX;
      this.view.y += event.clientY - before.clientY;
      this.isFitted = false;
      this.move();
    }
    this.pointers.set(event.pointerId, event);
  }
}
