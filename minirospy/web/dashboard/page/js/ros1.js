// Messages of ROS 1: the text of a definition becomes a description, by which bytes become objects and back.
// Pure. Source: http://wiki.ros.org/msg. Integers of 64 bits become numbers where these are exact, else BigInt.

const INT64 = { size: 8 };
const PRIMITIVES = {
  bool: {
    size: 1,
    get: (v, o) => v.getUint8(o) !== 0,
    set: (v, o, x) => v.setUint8(o, x ? 1 : 0),
    array: null,
    zero: false,
  },
  int8: { size: 1, get: (v, o) => v.getInt8(o), set: (v, o, x) => v.setInt8(o, x), array: Int8Array, zero: 0 },
  uint8: { size: 1, get: (v, o) => v.getUint8(o), set: (v, o, x) => v.setUint8(o, x), array: Uint8Array, zero: 0 },
  int16: {
    size: 2,
    get: (v, o) => v.getInt16(o, true),
    set: (v, o, x) => v.setInt16(o, x, true),
    array: Int16Array,
    zero: 0,
  },
  uint16: {
    size: 2,
    get: (v, o) => v.getUint16(o, true),
    set: (v, o, x) => v.setUint16(o, x, true),
    array: Uint16Array,
    zero: 0,
  },
  int32: {
    size: 4,
    get: (v, o) => v.getInt32(o, true),
    set: (v, o, x) => v.setInt32(o, x, true),
    array: Int32Array,
    zero: 0,
  },
  uint32: {
    size: 4,
    get: (v, o) => v.getUint32(o, true),
    set: (v, o, x) => v.setUint32(o, x, true),
    array: Uint32Array,
    zero: 0,
  },
  int64: {
    ...INT64,
    get: (v, o) => exact(v.getBigInt64(o, true)),
    set: (v, o, x) => v.setBigInt64(o, BigInt(x), true),
    array: null,
    zero: 0,
  },
  uint64: {
    ...INT64,
    get: (v, o) => exact(v.getBigUint64(o, true)),
    set: (v, o, x) => v.setBigUint64(o, BigInt(x), true),
    array: null,
    zero: 0,
  },
  float32: {
    size: 4,
    get: (v, o) => v.getFloat32(o, true),
    set: (v, o, x) => v.setFloat32(o, x, true),
    array: Float32Array,
    zero: 0,
  },
  float64: {
    size: 8,
    get: (v, o) => v.getFloat64(o, true),
    set: (v, o, x) => v.setFloat64(o, x, true),
    array: Float64Array,
    zero: 0,
  },
  time: {
    size: 8,
    get: (v, o) => ({ secs: v.getUint32(o, true), nsecs: v.getUint32(o + 4, true) }),
    set: (v, o, x) => {
      v.setUint32(o, x.secs, true);
      v.setUint32(o + 4, x.nsecs, true);
    },
    array: null,
    zero: { secs: 0, nsecs: 0 },
  },
  duration: {
    size: 8,
    get: (v, o) => ({ secs: v.getInt32(o, true), nsecs: v.getInt32(o + 4, true) }),
    set: (v, o, x) => {
      v.setInt32(o, x.secs, true);
      v.setInt32(o + 4, x.nsecs, true);
    },
    array: null,
    zero: { secs: 0, nsecs: 0 },
  },
};
PRIMITIVES.byte = PRIMITIVES.int8;
PRIMITIVES.char = PRIMITIVES.uint8;

const IS_LITTLE_ENDIAN = new Uint8Array(new Uint16Array([1]).buffer)[0] === 1;
const MAX_EMPTY = 1_000_000; // elements without bytes, which no length of a message limits
const TEXT = new TextDecoder();
const BYTES = new TextEncoder();

/** An error whose text, and the values in it, can be translated. */
export class TextError extends Error {
  constructor(text, values = {}) {
    super(text.replace(/\{(\w+)\}/g, (all, name) => values[name] ?? all));
    this.text = text;
    this.values = values;
  }
}

export class MessageError extends TextError {}

function exact(value) {
  const number = Number(value);
  return Number.isSafeInteger(number) ? number : value;
}

/**
 * Return the description of a type: {name, fields: [{name, type, isArray, length, message}], constants}. Throws
 * MessageError.
 */
export function parseDefinition(name, text) {
  const sections = new Map();
  let current = { name, lines: [] };
  sections.set(name, current);
  for (const line of text.split("\n")) {
    if (/^={40,}\s*$/.test(line)) {
      current = null;
      continue;
    }
    const head = /^MSG:\s*(\S+)\s*$/.exec(line);
    if (current === null && head) {
      current = { name: head[1], lines: [] };
      // Of two definitions of one type the first counts.
      if (!sections.has(head[1])) sections.set(head[1], current);
    } else if (current) {
      current.lines.push(line);
    }
  }
  const done = new Map();
  return build(name, sections, done, new Set());
}

function build(name, sections, done, open) {
  if (done.has(name)) return done.get(name);
  if (open.has(name)) throw new MessageError("the definition of {name} contains itself", { name });
  const section = sections.get(name);
  if (!section) throw new MessageError("the definition of {name} is missing", { name });
  open.add(name);
  const found = { name, fields: [], constants: [] };
  for (const raw of section.lines) {
    const constant = /^\s*(\w+)\s+(\w+)\s*=\s*(.*?)\s*$/.exec(raw);
    const line = raw.replace(/#.*/, "").trim();
    if (!line) continue;
    if (constant && line.includes("=")) {
      const value = constant[1] === "string" ? constant[3] : constant[3].replace(/#.*/, "").trim();
      found.constants.push({ type: constant[1], name: constant[2], value });
      continue;
    }
    const field = /^([A-Za-z][\w/]*)(\[(\d*)\])?\s+([A-Za-z]\w*)$/.exec(line);
    if (!field) throw new MessageError('{name}: "{line}" is not a field', { name, line });
    const [, type, brackets, length, fieldName] = field;
    const isMessage = type !== "string" && !Object.hasOwn(PRIMITIVES, type);
    found.fields.push({
      name: fieldName,
      type,
      isArray: Boolean(brackets),
      length: length ? Number(length) : null,
      message: isMessage ? build(resolve(type, name, sections), sections, done, open) : null,
    });
  }
  open.delete(name);
  done.set(name, found);
  return found;
}

function resolve(type, inside, sections) {
  if (type.includes("/")) return type;
  if (type === "Header") return "std_msgs/Header";
  const own = `${inside.split("/")[0]}/${type}`;
  if (sections.has(own)) return own;
  for (const name of sections.keys()) if (name.endsWith(`/${type}`)) return name;
  return own;
}

class Reader {
  constructor(bytes) {
    this.bytes = bytes;
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    this.offset = 0;
  }

  take(size) {
    const start = this.offset;
    if (size > this.bytes.byteLength - start) throw new MessageError("the message is shorter than its definition");
    this.offset = start + size;
    return start;
  }

  length() {
    return this.view.getUint32(this.take(4), true);
  }

  text() {
    const length = this.length();
    const start = this.take(length);
    return TEXT.decode(this.bytes.subarray(start, start + length));
  }
}

/** Return the fewest bytes of a value. */
function leastSize(field) {
  if (field.isArray && field.length === null) return 4;
  const one = field.message
    ? field.message.fields.reduce((sum, each) => sum + leastSize(each), 0)
    : field.type === "string"
      ? 4
      : PRIMITIVES[field.type].size;
  return field.isArray ? one * field.length : one;
}

function readerOfOne(field) {
  if (field.message) return readerOfMessage(field.message);
  if (field.type === "string") return (reader) => reader.text();
  const { size, get } = PRIMITIVES[field.type];
  return (reader) => get(reader.view, reader.take(size));
}

function readerOfArray(field) {
  const count = field.length === null ? (reader) => reader.length() : () => field.length;
  const primitive = !field.message && field.type !== "string" ? PRIMITIVES[field.type] : null;
  if (primitive?.array && IS_LITTLE_ENDIAN) {
    return (reader) => {
      const length = count(reader);
      const start = reader.take(length * primitive.size) + reader.bytes.byteOffset;
      return new primitive.array(reader.bytes.buffer.slice(start, start + length * primitive.size));
    };
  }
  const readOne = readerOfOne(field);
  const least = leastSize({ ...field, isArray: false });
  return (reader) => {
    const length = count(reader);
    if (length * least > reader.bytes.byteLength - reader.offset || (!least && length > MAX_EMPTY)) {
      throw new MessageError("the message is shorter than its definition");
    }
    const found = new Array(length);
    for (let index = 0; index < length; index++) found[index] = readOne(reader);
    return found;
  };
}

const READERS = new WeakMap();

function readerOfMessage(definition) {
  let read = READERS.get(definition);
  if (!read) {
    const fields = definition.fields.map((field) => [
      field.name,
      field.isArray ? readerOfArray(field) : readerOfOne(field),
    ]);
    read = (reader) => {
      const found = {};
      for (const [name, readField] of fields) found[name] = readField(reader);
      return found;
    };
    READERS.set(definition, read);
  }
  return read;
}

/** Return the object of a message's bytes (Uint8Array). Throws MessageError. */
export function decode(definition, bytes) {
  const reader = new Reader(bytes);
  const found = readerOfMessage(definition)(reader);
  if (reader.offset !== bytes.byteLength) throw new MessageError("the message is longer than its definition");
  return found;
}

class Writer {
  constructor() {
    this.bytes = new Uint8Array(256);
    this.view = new DataView(this.bytes.buffer);
    this.size = 0;
  }

  room(size) {
    const start = this.size;
    this.size += size;
    if (this.size > this.bytes.length) {
      const bytes = new Uint8Array(Math.max(this.size, this.bytes.length * 2));
      bytes.set(this.bytes.subarray(0, start));
      this.bytes = bytes;
      this.view = new DataView(bytes.buffer);
    }
    return start;
  }

  length(value) {
    const start = this.room(4);
    this.view.setUint32(start, value, true);
  }
}

/** Return the bytes of an object; a field that is missing gets its zero. Throws MessageError with the field's path. */
export function encode(definition, value) {
  const writer = new Writer();
  writeMessage(writer, definition, value ?? {}, "");
  return writer.bytes.slice(0, writer.size);
}

const INTEGER = /^(u?)int(\d+)$/;

/** Throw MessageError if a number is not one of a type: what does not fit would become another number. */
function checkNumber(name, type, value) {
  const text = String(value);
  const integer = INTEGER.exec({ byte: "int8", char: "uint8" }[type] ?? type);
  if (integer && typeof value === "number" && !Number.isInteger(value))
    throw new MessageError("{name}: {text} is not a whole number", { name, text });
  const fits = integer
    ? BigInt(value) === (integer[1] ? BigInt.asUintN : BigInt.asIntN)(Number(integer[2]), BigInt(value))
    : type !== "float32" || !Number.isFinite(value) || Number.isFinite(Math.fround(value));
  if (!fits) throw new MessageError("{name}: {text} does not fit into {type}", { name, text, type });
}

function checkTime(name, type, { secs, nsecs }) {
  if (typeof secs !== "number" || typeof nsecs !== "number")
    throw new MessageError("{name}: not {secs, nsecs}", { name });
  for (const each of [secs, nsecs]) checkNumber(name, type === "time" ? "uint32" : "int32", each);
}

function writeMessage(writer, definition, value, path) {
  if (typeof value !== "object" || value === null || isList(value))
    throw new MessageError("{name}: not an object", { name: path || definition.name });
  for (const name of Object.keys(value)) {
    if (!definition.fields.some((field) => field.name === name)) {
      const fields = definition.fields.map((field) => field.name).join(", ");
      throw new MessageError(
        fields ? "{name}: there is no such field; there is {fields}" : "{name}: there is no such field; there is none",
        { name: path ? `${path}.${name}` : name, fields },
      );
    }
  }
  for (const field of definition.fields) {
    const where = path ? `${path}.${field.name}` : field.name;
    const given = value[field.name];
    if (!field.isArray) {
      writeOne(writer, field, given, where);
      continue;
    }
    const items = given ?? new Array(field.length ?? 0).fill(undefined);
    if (!isList(items)) throw new MessageError("{name}: not an array", { name: where });
    if (field.length !== null && items.length !== field.length) {
      throw new MessageError("{name}: {count} values, where {wanted} are wanted", {
        name: where,
        count: items.length,
        wanted: field.length,
      });
    }
    if (field.length === null) writer.length(items.length);
    for (let index = 0; index < items.length; index++) writeOne(writer, field, items[index], `${where}[${index}]`);
  }
}

function writeOne(writer, field, value, name) {
  if (value === null) throw new MessageError("{name}: null is not a value", { name });
  if (field.message) {
    writeMessage(writer, field.message, value ?? {}, name);
  } else if (field.type === "string") {
    if (value !== undefined && typeof value !== "string") throw new MessageError("{name}: not a text", { name });
    const bytes = BYTES.encode(value ?? "");
    writer.length(bytes.length);
    const start = writer.room(bytes.length);
    writer.bytes.set(bytes, start);
  } else {
    const { size, set, zero } = PRIMITIVES[field.type];
    const checked = value ?? zero;
    if (
      typeof zero === "number" &&
      typeof checked !== "number" &&
      typeof checked !== "bigint" &&
      typeof checked !== "boolean"
    ) {
      throw new MessageError("{name}: not a number", { name });
    }
    if (typeof zero === "boolean" && typeof checked !== "boolean" && checked !== 0 && checked !== 1)
      throw new MessageError("{name}: neither true nor false", { name });
    if (typeof zero === "object") checkTime(name, field.type, checked);
    else checkNumber(name, field.type, checked);
    const start = writer.room(size);
    try {
      set(writer.view, start, checked);
    } catch (error) {
      throw new MessageError(`${name}: ${error.message}`);
    }
  }
}

/** Return an object whose fields all have their zero, as a form starts with. */
export function zeroOf(definition) {
  const found = {};
  for (const field of definition.fields) {
    const one = () =>
      field.message
        ? zeroOf(field.message)
        : field.type === "string"
          ? ""
          : structuredClone(PRIMITIVES[field.type].zero);
    found[field.name] = field.isArray ? Array.from({ length: field.length ?? 0 }, one) : one();
  }
  return found;
}

/**
 * Return whether a value of a message is an array: a message may have a field called "length", too.
 * @returns {value is any[]}
 */
export function isList(value) {
  return Array.isArray(value) || ArrayBuffer.isView(value);
}

/** Return whether a field's type is a number, a bool or a time: what can be plotted. */
export function isNumeric(type) {
  return Object.hasOwn(PRIMITIVES, type);
}
