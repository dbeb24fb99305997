// Paths of fields: "/turtle1/pose/x", "/odom.pose.pose.position.x", "/scan/ranges[0]", "/scan/ranges[0:5]", the
// value of a joint: "/joint_states/position[elbow]", an angle of a quaternion: "/imu/orientation/yaw", and those of
// elements with a value: "/markers/markers[:]{ns=='goal'}{id>=2}/pose/position/x". Pure.
// introspect/field_series.py reads the same paths for bags; tests/web/page/paths.json compares both.

import { TextError, isList, isNumeric } from "./ros1.js";

const MAX_VALUES = 50; // of one path, as of a whole array
const MAX_TESTED = 10_000; // elements
const MAX_PATH = 1000; // characters; the search for a step's end is quadratic in them
const MAX_STEPS = 50; // as messages inside messages

/** @type {Record<string, (x: number, y: number, z: number, w: number) => number>} */
const ANGLES = {
  roll: (x, y, z, w) => Math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
  pitch: (x, y, z, w) => Math.asin(Math.min(1, Math.max(-1, 2 * (w * y - z * x)))),
  yaw: (x, y, z, w) => Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
};
const QUATERNION = ["x", "y", "z", "w"];

// An element by name: [elbow], and in quotes (\x22, \x27) a name that would be an index or has a colon.
const NAMED =
  /^\[(?:\x22([^\x22\][]+)\x22|\x27([^\x27\][]+)\x27|([^\][:\x22\x27]*[^\][:\x22\x27\d-][^\][:\x22\x27]*))\]/;
const UNNAMED = /[\x22\][]/; // characters that no step by name can have
const AS_INDEX = /^[-\d:]+$|[:\x27]/;

const TIME_PARTS = ["secs", "nsecs"].map((name) => ({ name, type: "int32", isArray: false }));

const TESTS = {
  "==": (one, other) => one === other,
  "!=": (one, other) => one !== other,
  "<": (one, other) => one < other,
  "<=": (one, other) => one <= other,
  ">": (one, other) => one > other,
  ">=": (one, other) => one >= other,
};

/** Return the topic of a path among those that are known, the longest that fits; null if none does. */
export function topicOf(path, topics) {
  let found = null;
  for (const topic of topics) {
    const next = path[topic.length];
    const fits = path.startsWith(topic) && (next === undefined || "/.[{".includes(next));
    if (fits && (found === null || topic.length > found.length)) found = topic;
  }
  return found;
}

/** A path that leads to no number. */
export class PathError extends TextError {}

/**
 * Return the steps of a path behind its topic: names, numbers, {from, to}, {named}: the element that belongs to this
 * string in the array "name" beside it, {test, text}: a function of a value. Throws PathError.
 */
export function parseSteps(text) {
  if (text.length > MAX_PATH)
    throw new PathError("a path behind its topic has at most {most} characters", { most: MAX_PATH });
  const steps = [];
  let rest = text;
  while (rest) {
    if (steps.length === MAX_STEPS)
      throw new PathError("a path behind its topic has at most {most} steps", { most: MAX_STEPS });
    const match =
      /^[/.](\w+)|^\[(-?\d{1,9})\]|^\[(\d{0,9}):(\d{0,9})\]|^\{([\w./]+)\s*(==|!=|<=?|>=?)\s*(?:"([^"]*)"|'([^']*)'|([^}"']+))\}/.exec(
        rest,
      );
    const named = match ? null : NAMED.exec(rest);
    if (named) {
      steps.push({ named: named[1] ?? named[2] ?? named[3] });
      rest = rest.slice(named[0].length);
      continue;
    }
    if (!match) throw new PathError('"{rest}" is not a field, nor an index, nor a filter as {id==1}', { rest });
    if (match[1] !== undefined) steps.push(match[1]);
    else if (match[2] !== undefined) steps.push(Number(match[2]));
    else if (match[5] !== undefined) steps.push({ test: testOf(match), text: match[0] });
    else steps.push({ from: match[3] ? Number(match[3]) : 0, to: match[4] ? Number(match[4]) : Infinity });
    rest = rest.slice(match[0].length);
  }
  return steps;
}

/** @param {string[]} match */
function testOf([, , , , , path, operator, ...texts]) {
  const names = path.split(/[./]/);
  const text = texts.find((each) => each !== undefined).trim();
  const wanted =
    texts[2] === undefined
      ? text
      : ({ true: 1, false: 0 }[text] ?? (text !== "" && Number.isFinite(Number(text)) ? Number(text) : text));
  return (value) => {
    const found = names.reduce(
      (each, name) => (each !== null && typeof each === "object" && Object.hasOwn(each, name) ? each[name] : undefined),
      value,
    );
    if (found === undefined) return false;
    if (typeof wanted !== "number") return TESTS[operator](String(found), wanted);
    const number = numberOf(found);
    return number === null ? operator === "!=" : TESTS[operator](number, wanted);
  };
}

/** Call found(label, number) for each number that the steps lead to. */
export function select(value, steps, found, label = "", depth = 0) {
  if (depth === steps.length) {
    leaves(value, found, label);
    return;
  }
  const step = steps[depth];
  if (typeof step === "string") {
    if (value === null || typeof value !== "object") return;
    if (Object.hasOwn(value, step)) {
      const { named } = steps[depth + 1] ?? {};
      if (named === undefined) select(value[step], steps, found, `${label}/${step}`, depth + 1);
      else if (isList(value.name) && isList(value[step])) {
        const index = value.name.indexOf(named);
        if (index >= 0 && index < value[step].length)
          select(value[step][index], steps, found, `${label}/${step}[${named}]`, depth + 2);
      }
    } else if (depth + 1 === steps.length) {
      const angle = angleOf(value, step);
      if (angle !== null) found(`${label}/${step}`, angle);
    }
  } else if (step.named !== undefined) {
    return;
  } else if (step.test) {
    if (step.test(value)) select(value, steps, found, label + step.text, depth + 1);
  } else if (!isList(value)) {
    return;
  } else if (typeof step === "number") {
    const index = step < 0 ? value.length + step : step;
    if (index in value) select(value[index], steps, found, `${label}[${step}]`, depth + 1);
  } else {
    // What a filter finds is one series, wherever it is in the array.
    const isFiltered = Boolean(steps[depth + 1]?.test);
    const end = Math.min(step.to, value.length, step.from + (isFiltered ? MAX_TESTED : MAX_VALUES));
    for (let index = step.from; index < end; index++)
      select(value[index], steps, found, `${label}[${isFiltered ? ":" : index}]`, depth + 1);
  }
}

/**
 * Return the steps to the elements of an array, by the strings of the array "name" beside it: [elbow]; null if they do
 * not belong to them.
 */
export function namedSteps(names, array) {
  if (!isList(names) || names.length !== array.length || new Set(names).size !== names.length) return null;
  const steps = Array.from(names, (name) => (typeof name === "string" ? quotedStep(name) : null));
  return steps.includes(null) ? null : steps;
}

function quotedStep(name) {
  if (!name || UNNAMED.test(name)) return null;
  return AS_INDEX.test(name) ? `["${name}"]` : `[${name}]`;
}

/** Return the names of the angles that a value has, as a quaternion does; otherwise []. */
export function anglesOf(value) {
  return Object.keys(ANGLES).filter((name) => !Object.hasOwn(value, name) && angleOf(value, name) !== null);
}

/** Return roll, pitch or yaw of a quaternion in radians, null if it is another name or no rotation. */
function angleOf(value, name) {
  if (!Object.hasOwn(ANGLES, name) || !QUATERNION.every((each) => typeof value[each] === "number")) return null;
  const { x, y, z, w } = value;
  const size = Math.hypot(x, y, z, w);
  // A quaternion of zeros, of a message that was not filled in, is no rotation.
  return size > 0 && Number.isFinite(size) ? ANGLES[name](x / size, y / size, z / size, w / size) : null;
}

/** Return a value as a number, null if it is none. */
export function numberOf(value) {
  if (typeof value === "number") return value;
  if (typeof value === "boolean") return value ? 1 : 0;
  if (typeof value === "bigint") return Number(value);
  if (value !== null && typeof value === "object" && "nsecs" in value && Object.keys(value).length === 2) {
    return value.secs + value.nsecs * 1e-9;
  }
  return null;
}

/** Return whether the steps may lead to a number in a message of this type. */
export function canLead(definition, steps) {
  let at = { message: definition, type: "", isArray: false };
  let around = at; // the message with the field of the last name
  for (const [depth, step] of steps.entries()) {
    if (step.test) continue;
    if (typeof step === "string") {
      const parts = at.type === "time" || at.type === "duration" ? TIME_PARTS : (at.message?.fields ?? []);
      const field = at.isArray ? null : parts.find(({ name }) => name === step);
      if (!field) return depth + 1 === steps.length && !at.isArray && isQuaternion(at.message) && step in ANGLES;
      around = at;
      at = field;
    } else if (step.named !== undefined) {
      // The step before it is the name of the array.
      const names = around.message?.fields.find(({ name }) => name === "name");
      if (typeof steps[depth - 1] !== "string" || !at.isArray || !names?.isArray || names.type !== "string")
        return false;
      at = { ...at, isArray: false };
    } else if (at.isArray) {
      at = { ...at, isArray: false };
    } else {
      return false;
    }
  }
  if (!at.message) return isNumeric(at.type);
  return !at.isArray && at.message.fields.some(({ type, isArray }) => isNumeric(type) && !isArray);
}

/** Return whether a type has the fields of a quaternion: its angles have paths, too. */
export function isQuaternion(message) {
  const fields = (message?.fields ?? []).filter(({ type, isArray }) => isNumeric(type) && !isArray);
  return QUATERNION.every((each) => fields.some(({ name }) => name === each));
}

/** Return the time in the header of a message; 0 if there is none. */
export function stampOf({ header }) {
  return header?.stamp?.nsecs === undefined ? 0 : numberOf(header.stamp);
}

function leaves(value, found, label) {
  const number = numberOf(value);
  if (number !== null) {
    found(label, number);
  } else if (value !== null && typeof value === "object") {
    if (isList(value)) {
      for (let index = 0; index < Math.min(value.length, MAX_VALUES); index++) {
        const each = numberOf(value[index]);
        if (each !== null) found(`${label}[${index}]`, each);
      }
      return;
    }
    // As rqt_plot: of a message the numbers that are directly in it.
    for (const [name, each] of Object.entries(value)) {
      const inner = numberOf(each);
      if (inner !== null) found(`${label}/${name}`, inner);
    }
  }
}

/** Return the paths of the numbers of a type, behind the topic's name; of arrays the first element; angles first. */
export function numericPaths(definition, most = 200) {
  const found = [];
  const visit = (message, prefix) => {
    if (isQuaternion(message)) {
      const isFree = (angle) => !message.fields.some(({ name }) => name === angle);
      found.push(
        ...Object.keys(ANGLES)
          .filter(isFree)
          .map((angle) => `${prefix}/${angle}`),
      );
    }
    for (const field of message.fields) {
      if (found.length >= most) return;
      const path = `${prefix}/${field.name}${field.isArray ? "[0]" : ""}`;
      if (field.message) visit(field.message, path);
      else if (isNumeric(field.type)) found.push(path);
    }
  };
  visit(definition, "");
  return found;
}
