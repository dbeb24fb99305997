// Paths of fields: "/turtle1/pose/x", "/odom.pose.pose.position.x", "/scan/ranges[0]", "/scan/ranges[0:5]", and of the
// elements with
// a value: "/markers/markers[:]{ns=='goal'}{id>=2}/pose/position/x". Pure.

import { TextError, isList, isNumeric } from "./ros1.js";

const MAX_VALUES = 50; // of one path, as of a whole array
const MAX_TESTED = 10_000; // elements

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
 * Return the steps of a path behind its topic: names, numbers, {from, to}, {test, text}: a function of a value. Throws
 * PathError.
 */
export function parseSteps(text) {
  const steps = [];
  let rest = text;
  while (rest) {
    const match =
      /^[/.](\w+)|^\[(-?\d+)\]|^\[(\d*):(\d*)\]|^\{([\w./]+)\s*(==|!=|<=?|>=?)\s*(?:"([^"]*)"|'([^']*)'|([^}"']+))\}/.exec(
        rest,
      );
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
    if (value !== null && typeof value === "object" && Object.hasOwn(value, step)) {
      select(value[step], steps, found, `${label}/${step}`, depth + 1);
    }
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
  for (const step of steps) {
    if (step.test) continue;
    if (typeof step === "string") {
      const parts = at.type === "time" || at.type === "duration" ? TIME_PARTS : (at.message?.fields ?? []);
      const field = at.isArray ? null : parts.find(({ name }) => name === step);
      if (!field) return false;
      at = field;
    } else if (at.isArray) {
      at = { ...at, isArray: false };
    } else {
      return false;
    }
  }
  if (!at.message) return isNumeric(at.type);
  return !at.isArray && at.message.fields.some(({ type, isArray }) => isNumeric(type) && !isArray);
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

/** Return the paths of the numbers of a type, behind the topic's name; of arrays the first element. */
export function numericPaths(definition, most = 200) {
  const found = [];
  const visit = (message, prefix) => {
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
