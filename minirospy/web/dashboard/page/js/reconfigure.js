// Configurations of dynamic_reconfigure: what a server describes, the values it has, requests that change them. Pure.
// Source: http://wiki.ros.org/dynamic_reconfigure; encodings of enums as parameter_generator writes them.

import { TextError } from "./ros1.js";

const LISTS = { bool: "bools", int: "ints", str: "strs", double: "doubles" };
const INT_LIMIT = 2 ** 31 - 1;
const TRUE = ["true", "yes", "on", "1"];
const FALSE = ["false", "no", "off", "0"];
const WORDS = { True: true, False: false, None: null };
const ESCAPES = { n: "\n", t: "\t", r: "\r", "\n": "" };

/** Return the value of a Python literal: dicts, lists, tuples, texts, numbers. Throws Error. */
export function parseLiteral(text) {
  const reader = { text, at: 0 };
  const value = literal(reader);
  blank(reader);
  if (reader.at < text.length)
    throw new TextError('"{text}" is not expected', { text: text.slice(reader.at, reader.at + 20) });
  return value;
}

function blank(reader) {
  while (/\s/.test(reader.text[reader.at] ?? "")) reader.at += 1;
  return reader.text[reader.at];
}

function literal(reader) {
  const first = blank(reader);
  if (first === "{") {
    return Object.fromEntries(
      items(reader, "}", () => {
        const key = literal(reader);
        if (blank(reader) !== ":") throw new TextError("a colon is missing");
        reader.at += 1;
        return [key, literal(reader)];
      }),
    );
  }
  if (first === "[") return items(reader, "]", () => literal(reader));
  if (first === "(") return items(reader, ")", () => literal(reader));
  const quoted = /^[uUbB]?(["'])/.exec(reader.text.slice(reader.at, reader.at + 2));
  if (quoted) return string(reader, quoted);
  const word = /^[-+\w.]+/.exec(reader.text.slice(reader.at))?.[0] ?? "";
  reader.at += word.length;
  if (Object.hasOwn(WORDS, word)) return WORDS[word];
  if (!word || Number.isNaN(Number(word)))
    throw new TextError('"{text}" is not a value', { text: word || first || "" });
  return Number(word);
}

function items(reader, end, read) {
  const found = [];
  reader.at += 1;
  while (blank(reader) !== end) {
    found.push(read());
    if (blank(reader) === ",") reader.at += 1;
    else if (blank(reader) !== end) throw new TextError("a comma is missing");
  }
  reader.at += 1;
  return found;
}

/**
 * Return the string that starts at the reader's place.
 * @param {any} reader
 * @param {string[]} opening the match of its prefix and quote
 */
function string(reader, [start, quote]) {
  reader.at += start.length;
  let found = "";
  while (reader.text[reader.at] !== quote) {
    if (reader.at >= reader.text.length) throw new TextError("a quote is missing");
    let next = reader.text[reader.at++];
    if (next === "\\") {
      next = reader.text[reader.at++] ?? "";
      const digits = { x: 2, u: 4, U: 8 }[next];
      if (digits) {
        next = String.fromCodePoint(parseInt(reader.text.slice(reader.at, reader.at + digits), 16));
        reader.at += digits;
      } else next = ESCAPES[next] ?? next;
    }
    found += next;
  }
  reader.at += 1;
  return found;
}

/** Return the constants of an enum, [{name, value, description}]; none if the text is not one. */
export function constantsOf(editMethod) {
  if (!editMethod) return [];
  try {
    const found = parseLiteral(editMethod).enum;
    return found.map(({ name, value, description }) => ({
      name: String(name),
      value,
      description: String(description ?? ""),
    }));
  } catch {
    return [];
  }
}

/** Return the tree of groups of a ConfigDescription and its parameters by name: {root, parameters}. */
export function describe(message) {
  const [least, greatest, usual] = [message.min, message.max, message.dflt].map(valuesOf);
  const parameters = new Map();
  const groups = new Map();
  for (const { name, type, parent, id, parameters: described } of message.groups) {
    if (groups.has(id)) continue;
    const group = { id, parent, name, type: type.toLowerCase(), parameters: [], groups: [] };
    for (const each of described) {
      const parameter = {
        name: each.name,
        type: each.type,
        description: each.description,
        min: least.get(each.name),
        max: greatest.get(each.name),
        usual: usual.get(each.name),
        constants: constantsOf(each.edit_method),
      };
      group.parameters.push(parameter);
      parameters.set(each.name, parameter);
    }
    groups.set(id, group);
  }
  const root = groups.get(0) ?? { id: 0, parent: 0, name: "Default", type: "", parameters: [], groups: [] };
  // A group whose parents do not lead to the root, or are a cycle, is not reached from it.
  for (const group of groups.values()) if (group !== root) groups.get(group.parent)?.groups.push(group);
  return { root, parameters };
}

/** Return the values of a Config by name. */
export function valuesOf(config) {
  return new Map(Object.values(LISTS).flatMap((list) => config[list].map(({ name, value }) => [name, value])));
}

/** Return the states of the groups of a Config by their numbers. */
export function statesOf(config) {
  return new Map(config.groups.map(({ id, state }) => [id, state]));
}

/** Return the Config of a request: values by name of those that shall change; states, where given, of all groups. */
export function requestOf(parameters, values, root = null, states = new Map()) {
  const request = { bools: [], ints: [], strs: [], doubles: [], groups: [] };
  for (const [name, value] of values) request[LISTS[parameters.get(name).type]].push({ name, value });
  const add = (group) => {
    request.groups.push({ name: group.name, state: states.get(group.id) ?? true, id: group.id, parent: group.parent });
    group.groups.forEach(add);
  };
  if (root) add(root);
  return request;
}

/** Return a value of the parameter's type, of what was typed, or of a file's value. Throws Error. */
export function converted({ name, type, constants }, given) {
  const text = String(given).trim();
  const constant = constants.find(
    (each) => typeof given === "string" && each.name.toLowerCase() === text.toLowerCase(),
  );
  if (constant) return constant.value;
  if (type === "str") return String(given);
  if (type === "bool") {
    if (TRUE.includes(text.toLowerCase())) return true;
    if (FALSE.includes(text.toLowerCase())) return false;
    throw new TextError('{name}: "{text}" is not true or false', { name, text });
  }
  const number =
    { inf: Infinity, "+inf": Infinity, "-inf": -Infinity, nan: NaN }[text.toLowerCase()] ??
    (text === "" ? NaN : Number(text));
  if (Number.isNaN(number) && text.toLowerCase() !== "nan")
    throw new TextError('{name}: "{text}" is not a number', { name, text });
  if (type === "double") return number;
  if (!Number.isInteger(number) || number > INT_LIMIT || number < -INT_LIMIT - 1)
    throw new TextError('{name}: "{text}" is not a whole number of 32 bits', { name, text });
  return number;
}

/** Return the step of a parameter's slider, null if its limits are none that a slider can show. */
export function sliderStep({ type, min, max }) {
  if (!Number.isFinite(min) || !Number.isFinite(max) || min >= max) return null;
  if (type === "int") return min <= -INT_LIMIT && max >= INT_LIMIT ? null : 1;
  if (type !== "double" || max - min > 1e100) return null;
  // A power of ten by which the field shows few digits, and the slider has a hundred steps at least.
  return 10 ** Math.floor(Math.log10((max - min) / 100));
}

/** Return a number as the fields show it: without the digits that binary fractions add. */
export function shownNumber(value) {
  return typeof value === "number" && !Number.isInteger(value) && Number.isFinite(value)
    ? String(Number(value.toPrecision(12)))
    : String(value);
}

/** Return values as a file of YAML that rqt_reconfigure and dynparam load. */
export function yamlOf(parameters, values) {
  const names = [...values.keys()].sort();
  return names
    .map((name) => `${yamlText(name)}: ${yamlValue(parameters.get(name)?.type, values.get(name))}\n`)
    .join("");
}

function yamlValue(type, value) {
  if (typeof value === "string") return yamlText(value);
  if (type !== "double") return String(value);
  if (Number.isNaN(value)) return ".nan";
  if (!Number.isFinite(value)) return value > 0 ? ".inf" : "-.inf";
  const text = String(value);
  // YAML 1.1: without a point it is an integer or a text.
  return /^-?\d+$/.test(text) ? `${text}.0` : text.replace(/^(-?\d+)e/, "$1.0e");
}

function yamlText(text) {
  const isPlain = /^[A-Za-z_/][\w/.-]*$/.test(text) && !/^(y|n|yes|no|on|off|true|false|null|nan|inf)$/i.test(text);
  if (isPlain) return text;
  // What JSON leaves as it is and YAML does not allow.
  return JSON.stringify(text).replace(
    /[\x7f-\x9f\u2028\u2029\ufeff]/g,
    (each) => `\\u${each.charCodeAt(0).toString(16).padStart(4, "0")}`,
  );
}
