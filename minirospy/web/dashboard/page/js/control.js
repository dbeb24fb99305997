// ros_control's names, limits and commands, for the views of controllers. Pure. Sources:
// http://wiki.ros.org/controller_manager, http://wiki.ros.org/rqt_joint_trajectory_controller.

import { parseXml } from "./scene/xml.js";

const CALLS = ["list_controllers", "load_controller", "unload_controller", "switch_controller"];
export const STRICT = 2; // SwitchController.STRICT
export const MIN_SECONDS = 0.5; // the shortest motion, before it is scaled: five commands at 10 Hz

/** Return the sorted names of the controller managers, such as /arm/controller_manager; `services`: name -> {type}. */
export function managersOf(services) {
  return [...services.keys()]
    .filter((name) => name.endsWith(`/${CALLS[0]}`))
    .map((name) => name.slice(0, -CALLS[0].length - 1))
    .filter((manager) =>
      CALLS.every((call) => services.get(`${manager}/${call}`)?.type.startsWith("controller_manager_msgs/")),
    )
    .sort();
}

/** Return the namespace of a manager's controllers, ending in /: that of the manager itself. */
export function namespaceOf(manager) {
  return manager.slice(0, manager.lastIndexOf("/") + 1);
}

/**
 * Return {name, type} of the controllers whose type is on the parameter server, sorted, without those that are loaded;
 * `parameters`: name -> value.
 */
export function unloadedOf(manager, parameters, loaded) {
  const start = namespaceOf(manager);
  const known = new Set(loaded);
  const found = [];
  for (const [parameter, type] of parameters) {
    if (typeof type !== "string" || !parameter.startsWith(start)) continue;
    const [name, key, ...others] = parameter.slice(start.length).split("/");
    if (key === "type" && !others.length && !known.has(name)) found.push({ name, type });
  }
  return found.sort((a, b) => (a.name < b.name ? -1 : 1));
}

/** Return whether a controller takes trajectories on its topic `command`. */
export function takesTrajectories({ type }) {
  return type.includes("JointTrajectoryController");
}

/** Return the joints of a controller: what it claims through its first hardware interface. */
export function jointsOf({ claimed_resources }) {
  return [...(claimed_resources[0]?.resources ?? [])];
}

/** Return the robot_description that a namespace sees: searched upwards, as ROS's searchParam; undefined if none. */
export function descriptionOf(namespace, parameters) {
  const parts = namespace.split("/").slice(0, -1);
  for (; parts.length; parts.pop()) {
    const found = parameters.get(`${parts.join("/")}/robot_description`);
    if (typeof found === "string") return found;
  }
  return undefined;
}

/**
 * Return the limits of a robot's joints, by name: {lower, upper, velocity, isPrismatic}; those of a safety_controller
 * if they are narrower. A joint without limits is left out. Throws XmlError.
 */
export function limitsOf(urdf) {
  const limits = new Map();
  for (const joint of parseXml(urdf).children.filter(({ name }) => name === "joint")) {
    const child = (/** @type {string} */ wanted) => joint.children.find(({ name }) => name === wanted)?.attributes;
    const { name, type } = joint.attributes;
    const limit = child("limit");
    if (!limit || type === "fixed" || child("mimic")) continue;
    const safety = child("safety_controller");
    const [low, high] = type === "continuous" ? [-Math.PI, Math.PI] : [numberOf(limit.lower), numberOf(limit.upper)];
    const lower = Math.max(low, numberOf(safety?.soft_lower_limit, -Infinity));
    const upper = Math.min(high, numberOf(safety?.soft_upper_limit, Infinity));
    const velocity = numberOf(limit.velocity);
    if (lower <= upper && velocity > 0) limits.set(name, { lower, upper, velocity, isPrismatic: type === "prismatic" });
  }
  return limits;
}

function numberOf(text, usual = NaN) {
  return text === undefined || text.trim() === "" ? usual : Number(text);
}

/**
 * Return the seconds of a motion: as long as the slowest joint needs at its highest velocity, and at least MIN_SECONDS,
 * divided by the speed, which is from 0 to 1. `joints`: {position, command, velocity} each.
 */
export function secondsOf(joints, speed) {
  const needed = joints.map(({ position, command, velocity }) => Math.abs(command - position) / velocity);
  return Math.max(MIN_SECONDS, ...needed) / speed;
}
