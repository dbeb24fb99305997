// Interactive markers as they are shown and dragged: handles of controls that have no shapes, menus, where axes are,
// and what a drag does. Pure.
// Points and directions are arrays in the frame of the marker's header. Source:
// visualization_msgs/InteractiveMarkerControl.

import { t } from "../texts.js";
import { fromMessage, IDENTITY, multiply, normalized, rotate } from "./transforms.js";

export const [NONE, MENU, BUTTON, MOVE_AXIS, MOVE_PLANE, ROTATE_AXIS, MOVE_ROTATE, MOVE_3D, ROTATE_3D, MOVE_ROTATE_3D] =
  Array(10).keys();
export const [INHERIT, FIXED, VIEW_FACING] = Array(3).keys();
const MAX_CONTROLS = 200; // of a marker
const MAX_SHAPES = 1000; // of a marker
const MAX_ENTRIES = 1000; // of a menu
export const MAX_TEXT = 300; // characters of a title or description
const RING = 36; // parts
const EDGE_ON = 0.08; // sine of the angle below which a plane is seen from its side
const RADIANS_OF_PIXEL = 0.01;

// --- what a message says

/**
 * Return a marker with all that may be left out: {name, description, scale, pose, header, controls, menu}. Throws
 * Error.
 */
export function complete(message) {
  const { name, description, header, controls, menu_entries: entries } = message;
  const shapes = controls.reduce((sum, { markers }) => sum + markers.length, 0);
  for (const [count, most, text] of [
    [controls.length, MAX_CONTROLS, "{count} controls, more than {most}"],
    [shapes, MAX_SHAPES, "{count} markers in its controls, more than {most}"],
    [entries.length, MAX_ENTRIES, "{count} menu entries, more than {most}"],
  ]) {
    if (count > most) throw new Error(t(text, { count, most }));
  }
  const numbers = [
    message.scale,
    ...[message.pose.position, message.pose.orientation, ...controls.map(({ orientation }) => orientation)].flatMap(
      (each) => Object.values(each),
    ),
  ];
  if (!numbers.every(Number.isFinite)) throw new Error(t("Marker contains invalid floats!"));
  const scale = message.scale || 1;
  return {
    name,
    description: description.slice(0, MAX_TEXT),
    header,
    scale,
    pose: fromMessage(message.pose),
    menu: menuOf(entries),
    controls: withNames(controls).map((control) => completeControl(control, scale)),
  };
}

/** Return the controls with names that differ, as RViz has them in its feedback. */
function withNames(controls) {
  const names = new Set();
  let count = 0;
  return controls.map((control) => {
    let { name } = control;
    while (names.has(name)) name = `${control.name}_u${count++}`;
    names.add(name);
    return { ...control, name };
  });
}

function completeControl(control, scale) {
  const { name, description, interaction_mode: mode, always_visible: isAlways, markers: shapes } = control;
  const { x, y, z, w } = control.orientation;
  const q = normalized([x, y, z, w]);
  const made = {
    name,
    description: description.slice(0, MAX_TEXT),
    mode,
    q,
    isAlways,
    facing: control.orientation_mode,
    isIndependent: control.independent_marker_orientation,
    shapes,
  };
  if (shapes.length) return made;
  if (mode === MENU)
    return { ...made, facing: VIEW_FACING, isIndependent: false, shapes: [textShape(made.description, scale)] };
  return { ...made, shapes: defaultShapes(mode, q, scale) };
}

/** @param {number[]} color */
const shape = (type, q, scale, color, rest) => ({
  type,
  pose: { position: { x: 0, y: 0, z: 0 }, orientation: { x: q[0], y: q[1], z: q[2], w: q[3] } },
  scale: { x: scale[0], y: scale[1], z: scale[2] },
  color: { r: color[0], g: color[1], b: color[2], a: 0.5 },
  points: [],
  colors: [],
  ...rest,
  header: { frame_id: "" },
});
const point = (x, y, z) => ({ x, y, z });

function textShape(text, scale) {
  const found = shape(9, IDENTITY.q, [0, 0, 0.15 * scale], [1, 1, 1], { text });
  found.pose.position.z = 1.2 * scale;
  found.color.a = 1;
  return found;
}

/** Return arrows or a ring around a control's x axis, in the color of the axis of the marker that it is next to. */
function defaultShapes(mode, q, scale) {
  const along = rotate(q, [1, 0, 0]).map(Math.abs);
  const color = along.map((part, index) => Number(along.every((other, at) => at === index || part > other)));
  if (mode === MOVE_AXIS) {
    const size = [0.15 * scale, 0.25 * scale, 0.2 * scale];
    return [1, -1].map((sign) =>
      shape(0, q, size, color, { points: [point(sign * 0.5 * scale, 0, 0), point(sign * 0.9 * scale, 0, 0)] }),
    );
  }
  if (![MOVE_PLANE, ROTATE_AXIS, MOVE_ROTATE].includes(mode)) return [];
  const corner = (index, radius) =>
    point(0, radius * Math.cos((index * 2 * Math.PI) / RING), radius * Math.sin((index * 2 * Math.PI) / RING));
  const points = [];
  const colors = [];
  for (let part = 0; part < RING; part++) {
    const [inner, outer, innerNext, outerNext] = [
      corner(part, 0.5),
      corner(part, 0.65),
      corner(part + 1, 0.5),
      corner(part + 1, 0.65),
    ];
    points.push(inner, outer, innerNext, innerNext, outer, outerNext);
    // Stripes are turned, a plain ring is moved.
    const light = mode === MOVE_PLANE ? 1 : mode === ROTATE_AXIS ? 0.6 + 0.4 * (part % 2) : part % 4 > 1 ? 1 : 0.6;
    const [r, g, b] = color.map((each) => each * light);
    colors.push({ r, g, b, a: 0.5 }, { r, g, b, a: 0.5 });
  }
  return [shape(11, q, [scale, scale, scale], color, { points, colors })];
}

/**
 * Return the tree of menu entries: [{id, title, isChecked: true, false or null, command: what only RViz starts,
 * children}].
 */
function menuOf(entries) {
  const top = [];
  const known = new Map([[0, top]]);
  for (const { id, parent_id: parent, title, command, command_type: kind } of entries) {
    // As in RViz: an entry comes behind its parent.
    if (!id || known.has(id) || !known.has(parent)) continue;
    const box = /^\[([ x])\]\s*/.exec(title);
    const children = [];
    known.set(id, children);
    known.get(parent).push({
      id,
      title: (box ? title.slice(box[0].length) : title).slice(0, MAX_TEXT),
      isChecked: box && box[1] === "x",
      children,
      command: kind ? `${kind === 1 ? "rosrun" : "roslaunch"} ${command}`.slice(0, MAX_TEXT) : "",
    });
  }
  return top;
}

// --- where controls are

/** @param {number[]} axis @param {number} angle */
const turn = ([x, y, z], angle) => [
  x * Math.sin(angle / 2),
  y * Math.sin(angle / 2),
  z * Math.sin(angle / 2),
  Math.cos(angle / 2),
];

/**
 * Return {frame, shapes}: the rotations of a control, and of its shapes. `view` is x forward, y left, z up of the
 * picture.
 */
export function rotationsOf({ facing, isIndependent, q, initial, rotation }, markerQ, view) {
  if (facing === VIEW_FACING) {
    const frame = multiply(view, turn([1, 0, 0], rotation));
    return { frame, shapes: isIndependent ? markerQ : frame };
  }
  const frame = facing === FIXED ? multiply(initial, turn(rotate(q, [1, 0, 0]), rotation)) : markerQ;
  return { frame, shapes: frame };
}

// --- dragging

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const plus = (a, b, factor = 1) => a.map((part, index) => part + b[index] * factor);
const minus = (a, b) => plus(a, b, -1);

/** Return how far along a line (a point, a unit direction) it is closest to a ray, null if they are parallel. */
function along(start, direction, ray) {
  const slope = dot(direction, ray.direction);
  const square = 1 - slope * slope;
  if (square < 1e-4) return null;
  const between = minus(ray.origin, start);
  return (dot(between, direction) - dot(between, ray.direction) * slope) / square;
}

/** Return where a ray meets the plane through a point, null if it does not. */
function onPlane(through, normal, { origin, direction }) {
  const slope = dot(direction, normal);
  if (Math.abs(slope) < 0.02) return null;
  const far = dot(minus(through, origin), normal) / slope;
  return far > 0 ? plus(origin, direction, far) : null;
}

/**
 * A drag of a control; `axis` is the control's x axis, `grabbed` the point under the mouse, `ray` that of the mouse:
 * {origin, direction}.
 */
export class Drag {
  constructor({ mode, pose, axis, grabbed, ray }) {
    this.mode = mode;
    this.start = pose;
    this.pose = pose;
    this.axis = axis;
    this.grabbed = grabbed;
    this.middle = plus(pose.p, axis, dot(minus(grabbed, pose.p), axis)); // of the circle of what is turned
    this.center = this.middle;
    this.arm = minus(grabbed, this.middle);
    this.radius = Math.hypot(...this.arm);
    this.angle = 0;
    const tangent = cross(ray.direction, axis);
    const length = Math.hypot(...tangent);
    this.tangent = Math.abs(dot(ray.direction, axis)) < EDGE_ON ? tangent.map((part) => part / length) : null;
  }

  /**
   * Take over where the mouse is; `by` is {right, up, forward, metres (of a pixel), dx, dy, isFar, isTurn}. Return the
   * marker's pose, null if it stays.
   */
  move(ray, by) {
    const found = MOVES[this.mode]?.(this, ray, by) ?? null;
    if (found) this.pose = found;
    return found;
  }

  turned(angle, p = this.start.p) {
    this.angle = angle;
    return { p, q: normalized(multiply(turn(this.axis, angle), this.start.q)) };
  }

  angleTo(arm) {
    return Math.atan2(dot(this.axis, cross(this.arm, arm)), dot(this.arm, arm));
  }
}

function moveAxis(drag, ray) {
  const far = along(drag.grabbed, drag.axis, ray);
  return far === null ? null : { ...drag.start, p: plus(drag.start.p, drag.axis, far) };
}

function movePlane(drag, ray) {
  const hit = onPlane(drag.grabbed, drag.axis, ray);
  return hit && { ...drag.start, p: plus(drag.start.p, minus(hit, drag.grabbed)) };
}

function rotateAxis(drag, ray) {
  if (drag.radius < 1e-6) return null;
  if (drag.tangent) {
    const far = along(drag.grabbed, drag.tangent, ray);
    return far === null ? null : drag.turned(far / drag.radius);
  }
  const hit = onPlane(drag.grabbed, drag.axis, ray);
  return hit && drag.turned(drag.angleTo(minus(hit, drag.middle)));
}

/** The grabbed point stays at the mouse, and the marker follows it as a trailer does. */
function moveRotate(drag, ray) {
  const hit = onPlane(drag.grabbed, drag.axis, ray);
  const arm = hit && minus(hit, drag.center);
  const length = arm && Math.hypot(...arm);
  if (!length || drag.radius < 1e-6) return null;
  drag.center = plus(hit, arm, -drag.radius / length);
  return drag.turned(drag.angleTo(arm), plus(drag.start.p, minus(drag.center, drag.middle)));
}

function move3d({ pose: { p, q } }, ray, { right, up, forward, metres, dx, dy, isFar }) {
  return { p: isFar ? plus(p, forward, -dy * metres) : plus(plus(p, right, dx * metres), up, -dy * metres), q };
}

function rotate3d({ pose: { p, q } }, ray, { right, up, dx, dy }) {
  return {
    p,
    q: normalized(multiply(multiply(turn(up, dx * RADIANS_OF_PIXEL), turn(right, dy * RADIANS_OF_PIXEL)), q)),
  };
}

const MOVES = {
  [MOVE_AXIS]: moveAxis,
  [MOVE_PLANE]: movePlane,
  [ROTATE_AXIS]: rotateAxis,
  [MOVE_ROTATE]: moveRotate,
  [MOVE_3D]: move3d,
  [ROTATE_3D]: rotate3d,
  [MOVE_ROTATE_3D]: (drag, ray, by) => (by.isTurn ? rotate3d : move3d)(drag, ray, by),
};

export const isDragged = (mode) => Object.hasOwn(MOVES, mode);

/**
 * Return a pose as a geometry_msgs/Pose.
 * @param {{p: number[], q: number[]}} pose
 */
export function toMessage({ p: [x, y, z], q: [qx, qy, qz, qw] }) {
  return { position: { x, y, z }, orientation: { x: qx, y: qy, z: qz, w: qw } };
}
