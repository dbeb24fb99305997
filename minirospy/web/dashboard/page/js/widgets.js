// The small panels: their settings as text in links, the value of a field of any type, the message that sets one. Pure.

import { numberOf, parseSteps } from "./paths.js";
import { TextError, isList } from "./ros1.js";

/** Kind -> what it does, and its settings with their usual values. */
export const KINDS = {
  value: { title: "Value", isWriter: false, settings: { unit: "" } },
  lamp: { title: "Lamp", isWriter: false, settings: { at: "0.5", color: "green" } },
  gauge: { title: "Gauge", isWriter: false, settings: { min: "0", max: "1", unit: "" } },
  switch: { title: "Switch", isWriter: true, settings: { on: "1", off: "0", type: "" } },
  slider: { title: "Slider", isWriter: true, settings: { min: "0", max: "1", step: "", unit: "", type: "" } },
  button: { title: "Button", isWriter: true, settings: { on: "1", release: "", type: "" } },
};
export const COLORS = ["green", "yellow", "red", "blue"];
export const MAX_PANELS = 60;

/** The texts of types that a topic may get which nobody publishes yet. */
export const TYPES = {
  "std_msgs/Bool": "bool data",
  "std_msgs/Float64": "float64 data",
  "std_msgs/Float32": "float32 data",
  "std_msgs/Int32": "int32 data",
  "std_msgs/UInt8": "uint8 data",
  "std_msgs/String": "string data",
  "std_msgs/Empty": "",
};

/** Return the settings of a panel's text, with the usual ones; null if it has no kind or no path. */
export function parsePanel(text) {
  const words = new URLSearchParams(text);
  const kind = words.get("kind");
  const path = words.get("path") ?? "";
  if (!Object.hasOwn(KINDS, kind) || !path.startsWith("/")) return null;
  const settings = Object.fromEntries(
    Object.entries(KINDS[kind].settings).map(([name, usual]) => [name, words.get(name) ?? usual]),
  );
  return { kind, path, label: words.get("label") ?? "", isService: words.get("service") === "1", ...settings };
}

/** Return the text of a panel; what is usual is left out. */
export function panelText({ kind, path, label, isService, ...settings }) {
  const usual = KINDS[kind].settings;
  const given = Object.entries(settings).filter(([name, value]) => Object.hasOwn(usual, name) && value !== usual[name]);
  return new URLSearchParams([
    ["kind", kind],
    ["path", path],
    ...(label ? [["label", label]] : []),
    ...(isService ? [["service", "1"]] : []),
    ...given,
  ]).toString();
}

/** Return the value that steps lead to; of a message with one field that field's. undefined if there is none. */
export function valueAt(message, steps) {
  let value = message;
  for (const step of steps) {
    if (value === null || typeof value !== "object") return undefined;
    if (typeof step === "string") value = Object.hasOwn(value, step) ? value[step] : undefined;
    else if (!isList(value)) return undefined;
    else if (typeof step === "number") value = value[step < 0 ? value.length + step : step];
    else value = Array.from(value).slice(step.from, step.to);
  }
  while (value !== null && typeof value === "object" && !isList(value) && numberOf(value) === null) {
    const inner = Object.values(value);
    if (inner.length !== 1) break;
    [value] = inner;
  }
  return value;
}

/** Return a message of a type in which one field is set, all others are zero. Throws Error. */
export function messageWith(definition, steps, text) {
  const message = {};
  let at = message;
  let inside = definition;
  let rest = [...steps];
  if (!definition.fields.length) return message;
  // Without a field it is the only one, as data of std_msgs.
  if (!rest.length) {
    if (definition.fields.length !== 1) throw new TextError("name a field: {fields}", { fields: namesOf(definition) });
    rest = [definition.fields[0].name];
  }
  while (rest.length) {
    const name = rest.shift();
    const field = inside.fields.find((each) => each.name === name);
    if (!field) throw new TextError('there is no field "{name}": there is {fields}', { name, fields: namesOf(inside) });
    if (field.isArray) throw new TextError('"{name}" is an array: a panel sets one value', { name });
    if (!field.message) {
      if (rest.length) throw new TextError('"{name}" has no fields', { name });
      at[name] = valueOf(field.type, text);
    } else {
      if (!rest.length) rest = field.message.fields.length === 1 ? [field.message.fields[0].name] : rest;
      if (!rest.length)
        throw new TextError('name a field of "{name}": {fields}', { name, fields: namesOf(field.message) });
      at[name] = {};
      at = at[name];
      inside = field.message;
    }
  }
  return message;
}

const namesOf = (definition) => definition.fields.map((field) => field.name).join(", ");

/** Return whether a value is that of a text: as a number if it is one. */
export function isSame(value, text) {
  const number = numberOf(value);
  if (number === null) return String(value) === text;
  return number === ({ true: 1, false: 0 }[text.trim().toLowerCase()] ?? Number(text));
}

function valueOf(type, text) {
  if (type === "string") return String(text);
  const number = { true: 1, false: 0 }[String(text).trim().toLowerCase()] ?? Number(text);
  if (!Number.isFinite(number) || String(text).trim() === "") throw new TextError('"{text}" is not a number', { text });
  if (type === "bool") return number !== 0;
  if (type === "time" || type === "duration")
    return { secs: Math.floor(number), nsecs: Math.round((number - Math.floor(number)) * 1e9) };
  if (type.endsWith("64") && type !== "float64") return BigInt(Math.round(number));
  return type.startsWith("float") ? number : Math.round(number);
}

/**
 * Return the path split at a topic or service that is known: [name, steps]; null if none fits. Throws Error on a bad
 * path.
 */
export function splitPath(path, names) {
  let found = null;
  for (const name of names) {
    const next = path[name.length];
    if (
      path.startsWith(name) &&
      (next === undefined || "/.[".includes(next)) &&
      (found === null || name.length > found.length)
    )
      found = name;
  }
  return found === null ? null : [found, parseSteps(path.slice(found.length))];
}
