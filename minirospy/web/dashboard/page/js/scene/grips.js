// Interactive markers under the mouse or a finger: dragging, clicks, menus; each is reported to the server.

import { t } from "../texts.js";
import { BUTTON_CLICK, KEEP_ALIVE, MENU_SELECT, MOUSE_DOWN, MOUSE_UP, POSE_UPDATE } from "./displays/interactive.js";
import { BUTTON, Drag, isDragged, MENU, NONE } from "./handles.js";
import { Menu } from "./menu.js";
import { apply, invert, rotate } from "./transforms.js";

const REPORT_MS = 33; // between two poses
const ALIVE_MS = 250; // the server keeps the marker for this page while it is reported
const LONG_MS = 600; // of a finger, for the menu
const STILL = 8; // pixels

export class Grips {
  constructor(view, hint) {
    this.view = view;
    this.hint = hint; // if there is no control
    this.menu = new Menu(view.frame);
    this.held = null; // {control, button, at: [x, y], point, drag, isChanged, reported, timer}
    this.over = null; // the control under the mouse
  }

  close() {
    this.cancel();
    this.menu.remove();
  }

  /** Return {control, point} of what is at a place of the picture, null without a control there. */
  find(x, y) {
    const { stage } = this.view;
    const displays = [...this.view.displays.values()].filter(({ groups }) => groups);
    if (!displays.length) return null;
    const box = stage.canvas.getBoundingClientRect();
    for (const shown of displays.flatMap(({ markers }) => [...markers.values()])) {
      for (const {
        label: { span },
        control,
      } of shown.labels) {
        const { left, right, top, bottom } = span.getBoundingClientRect();
        const isIn = x + box.left >= left && x + box.left <= right && y + box.top >= top && y + box.top <= bottom;
        if (control && isIn && !span.hidden) return control.mode === NONE ? null : { control, point: null };
      }
    }
    const hit = stage.hits(
      x,
      y,
      displays.flatMap((display) => display.groups()),
    )[0];
    let object = hit?.object;
    while (object && !object.userData.control) object = object.parent;
    const control = object?.userData.control;
    return control && control.mode !== NONE ? { control, point: hit.point.toArray() } : null;
  }

  // --- the mouse, a finger; what returns true is not for the view

  hover(x, y) {
    const found = this.find(x, y)?.control ?? null;
    if (found === this.over) return;
    this.light(this.over, 0);
    this.over = found;
    this.light(found, 0.25);
    this.view.stage.canvas.classList.toggle("grip", Boolean(found));
    this.view.say(found ? this.hintOf(found) : this.hint);
  }

  hintOf({ mode, description, shown }) {
    const words = mode === BUTTON ? t("click: press") : mode === MENU ? t("click: menu") : t("drag: move the marker");
    return [
      description || shown.description || shown.name,
      words,
      mode !== MENU && shown.menu.length ? t("right click, or hold: menu") : "",
    ]
      .filter(Boolean)
      .join(" · ");
  }

  leave() {
    this.cancel();
    this.light(this.over, 0);
    this.over = null;
    this.view.stage.canvas.classList.remove("grip");
  }

  down(event, x, y) {
    if (event.altKey || (event.button !== 0 && event.button !== 2)) return false;
    const found = this.find(x, y);
    if (!found || (event.button === 2 && !found.control.shown.menu.length)) return false;
    const { control, point } = found;
    if (!this.view.link.mayWrite) {
      this.view.say(t("This token is read-only."), true);
      return false;
    }
    event.preventDefault();
    this.held = {
      control,
      point,
      button: event.button,
      at: [x, y],
      drag: null,
      isChanged: false,
      reported: performance.now(),
    };
    if (event.button === 2) return true;
    // As RViz: a pose comes before each press and release.
    for (const each of [POSE_UPDATE, MOUSE_DOWN]) this.report(each, { point });
    if (isDragged(control.mode) && point) this.startDrag(x, y);
    if (event.pointerType === "touch" && control.shown.menu.length)
      this.held.long = setTimeout(() => this.openMenu(this.end()), LONG_MS);
    return true;
  }

  startDrag(x, y) {
    const { held } = this;
    const { control } = held;
    const { shown } = control;
    const ray = this.ray(x, y);
    shown.hold();
    held.rotation = control.rotation;
    held.drag = new Drag({
      mode: control.mode,
      pose: shown.pose,
      axis: shown.axisOf(control),
      grabbed: apply(invert(shown.outer), held.point),
      ray,
    });
    held.timer = setInterval(() => this.reportPose(), REPORT_MS);
    this.light(control, 0.5);
  }

  move(event, x, y) {
    const { held } = this;
    if (!held) return false;
    const [dx, dy] = [x - held.at[0], y - held.at[1]];
    if (!held.drag || held.control.shown.isClosed) return true;
    // A finger trembles.
    if (held.long && Math.hypot(dx, dy) < STILL) return true;
    clearTimeout(held.long);
    held.long = null;
    held.at = [x, y];
    const control = this.current();
    const pose = held.drag.move(this.ray(x, y), {
      ...this.directions(),
      dx,
      dy,
      isFar: event.shiftKey,
      isTurn: event.ctrlKey,
    });
    if (!pose || !control) return true;
    control.shown.pose = pose;
    control.rotation = held.rotation + held.drag.angle;
    held.isChanged = true;
    this.view.stage.invalidate();
    return true;
  }

  up(event, x, y) {
    const { held } = this;
    if (!held) return false;
    const found = event.type === "pointerup" ? this.find(x, y) : null;
    const isThere = Boolean(found) && found.control === this.current();
    const point = found?.point ?? null;
    const isStill = Math.hypot(x - held.at[0], y - held.at[1]) < STILL;
    if (held.button === 2) {
      this.held = null;
      if (isThere && isStill) this.openMenu({ ...held, at: [x, y], point });
      return true;
    }
    if (isThere && held.control.mode === BUTTON) this.report(BUTTON_CLICK, { point });
    this.end(point);
    if (isThere && held.control.mode === MENU) this.openMenu({ ...held, at: [x, y], point });
    return true;
  }

  /** End what is held, without a click; as when a second finger comes. */
  cancel() {
    if (this.held) this.end();
  }

  /** Report the last pose, and the end; return what was held. */
  end(point = null) {
    const { held } = this;
    clearTimeout(held.long);
    clearInterval(held.timer);
    if (held.button === 0) for (const each of [POSE_UPDATE, MOUSE_UP]) this.report(each, { point });
    if (held.drag) {
      held.control.shown.release();
      this.light(this.current(), 0);
    }
    this.held = null;
    this.view.context.isFresh = true;
    return held;
  }

  // --- reports

  /** Return the control that is held: the server may have replaced it by another of its name. */
  current() {
    const { control } = this.held;
    const found = control.shown.controls.find(({ name }) => name === control.name) ?? null;
    if (found) this.held.control = found;
    return found;
  }

  report(event, more = {}, { control } = this.held) {
    if (!control.shown.isClosed) control.shown.display.report(control, event, more);
  }

  /** Report the pose while a control is held: if it has changed, and now and then if it has not. */
  reportPose() {
    const { held } = this;
    const now = performance.now();
    if (!held.isChanged && now - held.reported < ALIVE_MS) return;
    this.report(held.isChanged ? POSE_UPDATE : KEEP_ALIVE);
    Object.assign(held, { isChanged: false, reported: now });
  }

  openMenu(held) {
    const { menu } = held.control.shown;
    if (menu.length)
      this.menu.open(...held.at, menu, ({ id }) => this.report(MENU_SELECT, { point: held.point, entry: id }, held));
  }

  // --- the picture

  light(control, level) {
    control?.group.traverse(({ material }) => {
      for (const each of [material ?? []].flat()) each.emissive?.setHex(each.userData.emission ?? 0).addScalar(level);
    });
    this.view.stage.invalidate();
  }

  /** Return the ray at a place of the picture in the frame of the held marker. */
  ray(x, y) {
    const { origin, direction } = this.view.stage.ray(x, y).ray;
    const inner = invert(this.held.control.shown.outer);
    return { origin: apply(inner, origin.toArray()), direction: rotate(inner.q, direction.toArray()) };
  }

  /** Return the directions of the picture in that frame, and the metres of a pixel at what is held. */
  directions() {
    const { stage } = this.view;
    const { elements: m } = stage.camera.matrixWorld;
    const { q } = invert(this.held.control.shown.outer);
    const [right, up, forward] = [
      [m[0], m[1], m[2]],
      [m[4], m[5], m[6]],
      [-m[8], -m[9], -m[10]],
    ];
    const depth = this.held.point.reduce((sum, part, index) => sum + (part - m[12 + index]) * forward[index], 0);
    const metres = (stage.view.kind === "top" ? 1 : depth) / stage.pixelsPerMetre;
    return { right: rotate(q, right), up: rotate(q, up), forward: rotate(q, forward), metres };
  }
}
