// A simulation under Gazebo's names: its state, requests to its services, the SDF of new models. Pure.
// Source: http://wiki.ros.org/gazebo_ros, http://sdformat.org/spec, and minirospy's own topics below /gazebo/window.

import { fromRpy, normalized, rotate } from "./scene/transforms.js";
import { schema } from "./scene/schemas.js";
import { TextError } from "./ros1.js";

export const NAMESPACE = "/gazebo";
export const topicOf = (name) => `${NAMESPACE}/window/${name}`;
export const serviceOf = (name) => `${NAMESPACE}/${name}`;
export const QUIET_MS = 3000; // without a state; it comes five times a second

export const STEP = { topic: topicOf("step"), type: "std_msgs/UInt32", schema: "uint32 data" };
export const MODEL_STATE = {
  topic: serviceOf("set_model_state"),
  type: "gazebo_msgs/ModelState",
  schema: schema("string model_name\ngeometry_msgs/Pose pose\ngeometry_msgs/Twist twist\nstring reference_frame"),
};

/** Kind -> the fields of its size and their usual values in metres. */
export const SHAPES = {
  box: { title: "Box", sizes: { "size x": 0.4, "size y": 0.4, "size z": 0.4 } },
  sphere: { title: "Sphere", sizes: { radius: 0.2 } },
  cylinder: { title: "Cylinder", sizes: { radius: 0.2, length: 0.4 } },
};

/** Direction -> unit vector in the world. */
export const DIRECTIONS = {
  "+x": [1, 0, 0],
  "-x": [-1, 0, 0],
  "+y": [0, 1, 0],
  "-y": [0, -1, 0],
  "+z": [0, 0, 1],
  "-z": [0, 0, -1],
};

const USUAL_DISTANCE = 6; // metres from a camera that does not see the ground
const MAX_DISTANCE = 40;
const MAX_NAME = 100; // characters of a model's name
const MAX_NUMBER = 1e6; // in any field
const DENSITY = 200; // kg/m^3 of new shapes, as light wood
const IS_NAME = /^[\p{L}\p{N}_.-]+$/u;

/** Return whether a simulation is there: its services that the window needs. */
export const isThere = (services) =>
  ["pause_physics", "get_world_properties", "set_model_state"].every((name) => services.has(serviceOf(name)));

/** Return {world, isPaused, time, factor, rate, step, camera} of a diagnostic_msgs/DiagnosticStatus. */
export function readState({ name, message, values }) {
  const numbers = Object.fromEntries(values.map(({ key, value }) => [key, Number(value)]));
  return {
    world: name,
    isPaused: message === "paused",
    time: numbers.time,
    factor: numbers.real_time_factor,
    rate: numbers.max_update_rate,
    step: numbers.time_step,
    camera: values.find(({ key }) => key === "camera")?.value ?? "",
  };
}

/**
 * Return the view {distance, focus, yaw, pitch} of a camera's pose, "x y z qx qy qz qw", which looks along x; null if
 * it is none. It turns around the point of the ground that the camera looks at.
 */
export function viewOf(camera) {
  const numbers = camera.split(" ").map(Number);
  if (numbers.length !== 7 || !numbers.every(Number.isFinite)) return null;
  const [p, q] = [numbers.slice(0, 3), normalized(numbers.slice(3))];
  const ahead = rotate(q, [1, 0, 0]);
  const ground = p[2] > 0 && ahead[2] < -0.05 ? p[2] / -ahead[2] : USUAL_DISTANCE;
  const distance = Math.min(ground, MAX_DISTANCE);
  return {
    distance,
    focus: p.map((part, index) => part + distance * ahead[index]),
    yaw: Math.atan2(-ahead[1], -ahead[0]),
    pitch: Math.asin(Math.min(1, Math.max(-1, -ahead[2]))),
  };
}

/** Return seconds as hours, minutes, seconds and thousandths. */
export function clockText(seconds) {
  if (!Number.isFinite(seconds)) return "–";
  const whole = Math.max(0, Math.round(seconds * 1000));
  const two = (value) => String(value).padStart(2, "0");
  const parts = [Math.floor(whole / 3_600_000), Math.floor(whole / 60_000) % 60, Math.floor(whole / 1000) % 60];
  return `${parts.map(two).join(":")}.${String(whole % 1000).padStart(3, "0")}`;
}

/** Return the number of a field's text. Throws TextError if it is none, or out of bounds. */
export function readNumber(text, name, { least = -MAX_NUMBER, most = MAX_NUMBER, isAbove = false } = {}) {
  const trimmed = String(text).trim().replace(",", ".");
  const value = trimmed === "" ? NaN : Number(trimmed);
  if (!Number.isFinite(value)) throw new TextError('{name}: "{text}" is not a number', { name, text: trimmed });
  if (value < least || value > most || (isAbove && value <= least))
    throw new TextError(
      isAbove
        ? "{name}: {value} is not above {least} and at most {most}"
        : "{name}: {value} is not from {least} to {most}",
      { name, value, least, most },
    );
  return value;
}

/** Return a model's name of a field. Throws TextError if it cannot be one. */
export function readName(text, known = []) {
  const name = String(text).trim();
  if (!name) throw new TextError("The model needs a name");
  if (name.length > MAX_NAME || !IS_NAME.test(name))
    throw new TextError('"{name}" cannot be a name: letters, digits, _ . - only', { name: name.slice(0, MAX_NAME) });
  if (known.includes(name)) throw new TextError('There is a model "{name}" already', { name });
  return name;
}

/** Return a name with a number that no model has: box_0, box_1, ... */
export function freeName(stem, known) {
  for (let index = 0; ; index++) if (!known.includes(`${stem}_${index}`)) return `${stem}_${index}`;
}

/** Return roll, pitch and yaw of a quaternion. */
export function toRpy([x, y, z, w]) {
  const sine = Math.min(1, Math.max(-1, 2 * (w * y - z * x)));
  return [
    Math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
    Math.asin(sine),
    Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
  ];
}

/**
 * Return a geometry_msgs/Pose.
 * @param {number[]} place
 */
export function poseOf([x, y, z], rpy = [0, 0, 0]) {
  const [qx, qy, qz, qw] = fromRpy(rpy);
  return { position: { x, y, z }, orientation: { x: qx, y: qy, z: qz, w: qw } };
}

/** Return the request of set_model_state: at rest, in the world. */
export function stateOf(model, pose) {
  const zero = { x: 0, y: 0, z: 0 };
  return { model_name: model, pose, twist: { linear: zero, angular: zero }, reference_frame: "world" };
}

/** Return a ros duration of seconds. */
export function durationOf(seconds) {
  const secs = Math.floor(seconds);
  return { secs, nsecs: Math.round((seconds - secs) * 1e9) };
}

/** Return the request of apply_body_wrench: a force in the world's axes at a point from the link's origin. */
export function pushOf(link, [x, y, z], [px, py, pz], seconds) {
  return {
    body_name: link,
    reference_frame: "world",
    reference_point: { x: px, y: py, z: pz },
    wrench: { force: { x, y, z }, torque: { x: 0, y: 0, z: 0 } },
    start_time: { secs: 0, nsecs: 0 },
    duration: durationOf(seconds),
  };
}

/** Return the steps per second of wall time for a speed (1 is real time, 0 as fast as possible). */
export const rateOf = (speed, step) => (speed > 0 ? speed / step : 0);

/** Return the height of a shape's centre above the ground. */
export function heightOf(kind, sizes) {
  return { box: () => sizes["size z"] / 2, sphere: () => sizes.radius, cylinder: () => sizes.length / 2 }[kind]();
}

const volumeOf = {
  box: (s) => s["size x"] * s["size y"] * s["size z"],
  sphere: ({ radius }) => (4 / 3) * Math.PI * radius ** 3,
  cylinder: ({ radius, length }) => Math.PI * radius ** 2 * length,
};

const inertiaOf = {
  box: (s, mass) => {
    const [x, y, z] = [s["size x"] ** 2, s["size y"] ** 2, s["size z"] ** 2];
    return [((y + z) * mass) / 12, ((x + z) * mass) / 12, ((x + y) * mass) / 12];
  },
  sphere: ({ radius }, mass) => Array(3).fill(0.4 * mass * radius ** 2),
  cylinder: ({ radius, length }, mass) => {
    const across = (mass * (3 * radius ** 2 + length ** 2)) / 12;
    return [across, across, (mass * radius ** 2) / 2];
  },
};

const geometryOf = {
  box: (s) => `<box><size>${s["size x"]} ${s["size y"]} ${s["size z"]}</size></box>`,
  sphere: ({ radius }) => `<sphere><radius>${radius}</radius></sphere>`,
  cylinder: ({ radius, length }) => `<cylinder><radius>${radius}</radius><length>${length}</length></cylinder>`,
};

/** Return the SDF of a shape. `rgb` has parts from 0 to 1. */
export function shapeSdf(kind, sizes, rgb) {
  const mass = volumeOf[kind](sizes) * DENSITY;
  const [xx, yy, zz] = inertiaOf[kind](sizes, mass);
  const geometry = `<geometry>${geometryOf[kind](sizes)}</geometry>`;
  const color = [...rgb.map((part) => Number(part.toFixed(3))), 1].join(" ");
  return (
    `<sdf version="1.6"><model name="${kind}"><link name="link">` +
    `<inertial><mass>${mass}</mass><inertia><ixx>${xx}</ixx><iyy>${yy}</iyy><izz>${zz}</izz>` +
    "<ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia></inertial>" +
    `<collision name="collision">${geometry}</collision>` +
    `<visual name="visual">${geometry}<material><ambient>${color}</ambient><diffuse>${color}</diffuse></material></visual>` +
    "</link></model></sdf>"
  );
}

/** Return the SDF that includes a model of the library. Throws TextError if the name cannot be one. */
export function librarySdf(model) {
  const name = readName(model);
  return `<sdf version="1.6"><include><uri>model://${name}</uri></include></sdf>`;
}

/** Return the request of spawn_sdf_model. */
export function spawnOf(name, xml, pose) {
  return { model_name: name, model_xml: xml, robot_namespace: "", initial_pose: pose, reference_frame: "world" };
}

/** Return the joints of a model: [{name, position, velocity}], of a sensor_msgs/JointState with model::joint. */
export function jointsOf({ name, position, velocity }, model) {
  const found = [];
  name.forEach((each, index) => {
    if (each.startsWith(`${model}::`))
      found.push({ name: each.slice(model.length + 2), position: position[index], velocity: velocity[index] });
  });
  return found;
}

/** Return a number with three decimals, and zero without a sign. */
export const threeDecimals = (value) => value.toFixed(3).replace(/^-(0\.0+)$/, "$1");

/** Return [model, link] of model::link. */
export function splitLink(scoped) {
  const at = scoped.indexOf("::");
  return at < 0 ? [scoped, ""] : [scoped.slice(0, at), scoped.slice(at + 2)];
}
