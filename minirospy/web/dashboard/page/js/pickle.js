// Userdata of smach: a pickle of plain values, read without making any object: what is not plain is named instead.
// Pure.
// Source: Python's Lib/pickletools.py (protocols 0 to 5, the opcodes that plain values need).

const MARK = Symbol("mark");
const MAX_DEPTH = 50;
const MAX_INTEGER_BYTES = 1000; // bytes of an integer that is read: longer ones would keep the page busy
const MAX_TEXT = 4000; // characters and values of one that is shown

export class PickleError extends Error {}

/**
 * Return the value of a pickle (Uint8Array). Dicts are Maps, other objects {kind: "module.Name"}. Throws PickleError.
 */
export function readPickle(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const stack = [];
  const memo = new Map();
  let at = 0;
  const need = (count) => {
    if (count < 0 || at + count > bytes.length) throw new PickleError("the pickle is cut off");
    at += count;
    return at - count;
  };
  const pop = () => {
    if (!stack.length) throw new PickleError("the pickle is damaged");
    return stack.pop();
  };
  const top = () => stack[stack.length - 1];
  const sinceMark = () => {
    const mark = stack.lastIndexOf(MARK);
    if (mark < 0) throw new PickleError("the pickle is damaged");
    const found = stack.splice(mark + 1);
    stack.pop();
    return found;
  };
  const line = () => {
    const end = bytes.indexOf(10, at);
    if (end < 0) throw new PickleError("the pickle is cut off");
    const text = latin(at, end);
    at = end + 1;
    return text;
  };
  const latin = (from, to) => Array.from(bytes.subarray(from, to), (each) => String.fromCharCode(each)).join("");
  const text = (length) => new TextDecoder().decode(bytes.subarray(need(length), at));
  const size = (width) => {
    const from = need(width);
    if (width === 8) return Number(view.getBigUint64(from, true));
    return width === 4 ? view.getUint32(from, true) : view.getUint8(from);
  };
  const long = (length) => {
    const from = need(length);
    if (length > MAX_INTEGER_BYTES) return { kind: `int of ${length} bytes` };
    let value = 0n;
    for (let index = length - 1; index >= 0; index--) value = (value << 8n) | BigInt(bytes[from + index]);
    value = length ? BigInt.asIntN(length * 8, value) : 0n;
    return value >= BigInt(Number.MIN_SAFE_INTEGER) && value <= BigInt(Number.MAX_SAFE_INTEGER) ? Number(value) : value;
  };
  const setItems = (items) => {
    const target = top();
    if (!(target instanceof Map)) return; // of an object that is not made
    for (let index = 0; index + 1 < items.length; index += 2) target.set(items[index], items[index + 1]);
  };
  const appended = (items) => {
    if (Array.isArray(top())) top().push(...items);
  };
  const made = (kind) => stack.push({ kind });
  const kindOf = (value) => (value !== null && typeof value === "object" && "kind" in value ? value.kind : "object");
  const OPCODES = {
    "\x80": () => size(1),
    "\x95": () => size(8),
    "(": () => stack.push(MARK),
    0: pop,
    1: sinceMark,
    2: () => stack.push(top()),
    N: () => stack.push(null),
    "\x88": () => stack.push(true),
    "\x89": () => stack.push(false),
    I: () => {
      const found = line();
      stack.push(found === "00" ? false : found === "01" ? true : Number(found));
    },
    L: () => stack.push(Number(line().replace(/L$/, ""))),
    F: () => stack.push(Number(line())),
    J: () => stack.push(view.getInt32(need(4), true)),
    K: () => stack.push(size(1)),
    M: () => stack.push(view.getUint16(need(2), true)),
    "\x8a": () => stack.push(long(size(1))),
    "\x8b": () => stack.push(long(size(4))),
    G: () => stack.push(view.getFloat64(need(8), false)),
    S: () => stack.push(line().slice(1, -1)),
    V: () => stack.push(line()),
    X: () => stack.push(text(size(4))),
    "\x8c": () => stack.push(text(size(1))),
    "\x8d": () => stack.push(text(size(8))),
    T: () => {
      const length = size(4);
      need(length);
      stack.push(latin(at - length, at));
    },
    U: () => {
      const length = size(1);
      need(length);
      stack.push(latin(at - length, at));
    },
    B: () => {
      const length = size(4);
      stack.push(bytes.slice(need(length), at));
    },
    C: () => {
      const length = size(1);
      stack.push(bytes.slice(need(length), at));
    },
    "\x8e": () => {
      const length = size(8);
      stack.push(bytes.slice(need(length), at));
    },
    ")": () => stack.push([]),
    "]": () => stack.push([]),
    "}": () => stack.push(new Map()),
    "\x8f": () => stack.push([]),
    t: () => stack.push(sinceMark()),
    l: () => stack.push(sinceMark()),
    d: () => {
      const items = sinceMark();
      stack.push(new Map());
      setItems(items);
    },
    "\x85": () => stack.push([pop()]),
    "\x86": () => {
      const b = pop();
      stack.push([pop(), b]);
    },
    "\x87": () => {
      const c = pop();
      const b = pop();
      stack.push([pop(), b, c]);
    },
    a: () => appended([pop()]),
    e: () => appended(sinceMark()),
    "\x90": () => appended(sinceMark()),
    "\x91": () => stack.push(sinceMark()),
    s: () => {
      const value = pop();
      setItems([pop(), value]);
    },
    u: () => setItems(sinceMark()),
    p: () => memo.set(Number(line()), top()),
    q: () => memo.set(size(1), top()),
    r: () => memo.set(size(4), top()),
    "\x94": () => memo.set(memo.size, top()),
    g: () => stack.push(memo.get(Number(line()))),
    h: () => stack.push(memo.get(size(1))),
    j: () => stack.push(memo.get(size(4))),
    c: () => {
      const module = line();
      made(`${module}.${line()}`);
    },
    "\x93": () => {
      const name = pop();
      made(`${pop()}.${name}`);
    },
    R: () => {
      pop();
      made(kindOf(pop()));
    },
    "\x81": () => {
      pop();
      made(kindOf(pop()));
    },
    "\x92": () => {
      pop();
      pop();
      made(kindOf(pop()));
    },
    b: pop,
    o: () => made(kindOf(sinceMark()[0])),
    i: () => {
      const module = line();
      const name = line();
      sinceMark();
      made(`${module}.${name}`);
    },
    P: () => {
      line();
      made("object");
    },
    Q: () => {
      pop();
      made("object");
    },
  };
  for (;;) {
    const name = String.fromCharCode(bytes[need(1)]);
    if (name === ".") return pop();
    const run = OPCODES[name];
    if (!run) throw new PickleError(`the pickle has an opcode that is not read: ${name.charCodeAt(0)}`);
    run();
    if (stack.length > 100_000) throw new PickleError("the pickle is too large");
  }
}

/** Return a value as one line, as Python writes it; what is very long is cut. */
export function pythonText(value, room = { left: MAX_TEXT }, depth = 0) {
  room.left -= 1;
  if (room.left < 0 || depth > MAX_DEPTH) return "…";
  const each = (item) => pythonText(item, room, depth + 1);
  if (value === null || value === undefined) return "None";
  if (typeof value === "boolean") return value ? "True" : "False";
  if (typeof value === "string") {
    const text = JSON.stringify(value.slice(0, Math.max(0, room.left)));
    room.left -= text.length;
    return text.length < value.length ? `${text}…` : text;
  }
  if (value instanceof Uint8Array) return `bytes (${value.length})`;
  if (value instanceof Map) return `{${joined([...value], room, ([name, item]) => `${each(name)}: ${each(item)}`)}}`;
  if (Array.isArray(value)) return `[${joined(value, room, each)}]`;
  if (typeof value === "object") return `<${value.kind}>`;
  return String(value);
}

function joined(items, room, show) {
  const parts = [];
  for (const item of items) {
    if (room.left < 0) break;
    parts.push(show(item));
  }
  return parts.join(", ");
}

/**
 * Return [name, text] of the values in local_data: base64 (a string, as smach_ros writes it) or bytes. Throws Error.
 */
export function userdataOf(data) {
  let bytes = data;
  if (typeof data === "string") {
    if (!data) return [];
    bytes = Uint8Array.from(atob(data.replace(/\s/g, "")), (each) => each.charCodeAt(0));
  }
  if (!bytes.length) return [];
  const found = readPickle(bytes);
  if (!(found instanceof Map)) throw new PickleError("the userdata is not a dict");
  return [...found].map(([name, value]) => [String(name), pythonText(value)]);
}
