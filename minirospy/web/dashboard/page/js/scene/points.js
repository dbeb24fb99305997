// Points of scans and clouds: positions and colors for drawing. Pure. Colors are chosen as RViz's color transformers
// choose.

import { t } from "../texts.js";
import { rainbow, rgbOf } from "./colors.js";

const READERS = {
  1: ["getInt8", 1],
  2: ["getUint8", 1],
  3: ["getInt16", 2],
  4: ["getUint16", 2],
  5: ["getInt32", 4],
  6: ["getUint32", 4],
  7: ["getFloat32", 4],
  8: ["getFloat64", 8],
};
const TYPED = {
  1: Int8Array,
  2: Uint8Array,
  3: Int16Array,
  4: Uint16Array,
  5: Int32Array,
  6: Uint32Array,
  7: Float32Array,
  8: Float64Array,
};

/**
 * Where the points of a message are: {count, positions: Float32Array, channels: Map of name -> Float32Array or
 * Uint32Array (rgb)}.
 */

/** Return the points of a sensor_msgs/LaserScan in its frame. */
export function pointsOfScan({
  angle_min: first,
  angle_increment: step,
  range_min: least,
  range_max: most,
  ranges,
  intensities,
}) {
  const positions = new Float32Array(ranges.length * 3);
  const intensity = intensities.length === ranges.length ? new Float32Array(ranges.length) : null;
  let count = 0;
  for (let index = 0; index < ranges.length; index++) {
    const range = ranges[index];
    // As in laser_geometry, which RViz uses: a range that equals the largest one was not measured.
    if (!(range >= least && range < most)) continue;
    const angle = first + index * step;
    positions[count * 3] = range * Math.cos(angle);
    positions[count * 3 + 1] = range * Math.sin(angle);
    if (intensity) intensity[count] = intensities[index];
    count += 1;
  }
  const channels = new Map(intensity ? [["intensity", intensity.subarray(0, count)]] : []);
  return { count, total: count, positions: positions.subarray(0, count * 3), channels };
}

/** Return the points of a sensor_msgs/PointCloud. */
export function pointsOfOldCloud({ points, channels }) {
  const positions = new Float32Array(points.length * 3);
  points.forEach(({ x, y, z }, index) => positions.set([x, y, z], index * 3));
  const found = new Map();
  for (const { name, values } of channels) {
    if (values.length !== points.length) continue;
    found.set(
      name,
      name === "rgb"
        ? new Uint32Array(values.buffer.slice(values.byteOffset, values.byteOffset + values.byteLength))
        : values,
    );
  }
  return { count: points.length, total: points.length, positions, channels: found };
}

/**
 * Return the points of a sensor_msgs/PointCloud2, every `stride`-th; `wanted` are the channels to read. Throws Error.
 */
export function pointsOfCloud(message, wanted = [], stride = 1) {
  const { width, height, point_step: step, data } = message;
  // Programs leave the fields of an empty cloud out.
  if (width * height === 0) return { count: 0, total: 0, positions: new Float32Array(), channels: new Map() };
  const fields = new Map(message.fields.map((field) => [field.name, field]));
  for (const name of ["x", "y", "z"]) {
    if (!fields.has(name))
      throw new Error(
        t("the cloud has no field {name}; it has {names}", { name, names: [...fields.keys()].join(", ") || "-" }),
      );
  }
  const total = width * height;
  const rows = message.row_step * height;
  if (step <= 0 || data.length < (total ? rows - message.row_step + width * step : 0)) {
    throw new Error(
      t("the cloud has {size} bytes, {width} x {height} points of {step} bytes need {need}", {
        size: data.length,
        width,
        height,
        step,
        need: total * step,
      }),
    );
  }

  const index = new Uint32Array(Math.ceil(total / stride));
  for (let point = 0, at = 0; point < total; point += stride) {
    index[at++] = Math.floor(point / width) * message.row_step + (point % width) * step;
  }
  const [x, y, z] = ["x", "y", "z"].map((name) => column(message, fields.get(name), index));
  const found = new Map();
  for (const name of wanted) {
    const field = fields.get(name);
    // Colors are four bytes, whatever the field's type says.
    if (field)
      found.set(name, column(message, name === "rgb" || name === "rgba" ? { ...field, datatype: 6 } : field, index));
  }

  const positions = new Float32Array(index.length * 3);
  const kept = new Uint32Array(index.length);
  let count = 0;
  for (let at = 0; at < index.length; at++) {
    if (!Number.isFinite(x[at] + y[at] + z[at])) continue;
    positions[count * 3] = x[at];
    positions[count * 3 + 1] = y[at];
    positions[count * 3 + 2] = z[at];
    kept[count++] = at;
  }
  if (count < index.length) {
    for (const [name, values] of found) {
      const packed = new values.constructor(count);
      for (let at = 0; at < count; at++) packed[at] = values[kept[at]];
      found.set(name, packed);
    }
  }
  return { count, total, positions: positions.subarray(0, count * 3), channels: found };
}

function column({ data, is_bigendian: isBig }, field, index) {
  const kind = READERS[field.datatype];
  if (!kind)
    throw new Error(t("the field {name} has the unknown datatype {type}", { name: field.name, type: field.datatype }));
  const [method, size] = kind;
  const found = field.datatype === 6 ? new Uint32Array(index.length) : new Float32Array(index.length);
  const start = data.byteOffset + field.offset;
  if (index.length && field.offset + index[index.length - 1] + size > data.length)
    throw new Error(t("the field {name} is outside of its point", { name: field.name }));
  // The usual case: aligned, of this machine's byte order. Six times as fast as a DataView.
  if (!isBig && start % size === 0 && index.every((at) => at % size === 0)) {
    const values = new TYPED[field.datatype](data.buffer, start, Math.floor((data.length - field.offset) / size));
    for (let at = 0; at < index.length; at++) found[at] = values[index[at] / size];
    return found;
  }
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  for (let at = 0; at < index.length; at++) found[at] = view[method](index[at] + field.offset, !isBig);
  return found;
}

/** Return the channels that a coloring needs. */
export function wantedChannels(settings) {
  const transformer = settings["Color Transformer"];
  if (transformer === "RGB8") return ["rgb", "rgba"];
  if (transformer === "RGBF32") return ["r", "g", "b"];
  return transformer === "Intensity" ? [settings["Channel Name"]] : [];
}

/** Return the transformer that suits a message's fields, in RViz's order of preference. */
export function suitableTransformer(names) {
  if (names.includes("rgb") || names.includes("rgba")) return "RGB8";
  if (["r", "g", "b"].every((name) => names.includes(name))) return "RGBF32";
  return names.includes("intensity") ? "Intensity" : "AxisColor";
}

/**
 * Return the colors (RGB bytes) of points, null for the flat color. `transform` leads into the fixed frame, for colors
 * of an axis there.
 */
export function colorsOf(points, settings, transform = null) {
  const transformer = settings["Color Transformer"];
  if (transformer === "RGB8")
    return packedColors(points.channels.get("rgb") ?? points.channels.get("rgba"), points.count);
  if (transformer === "RGBF32")
    return floatColors(
      ["r", "g", "b"].map((name) => points.channels.get(name)),
      points.count,
    );
  if (transformer === "Intensity") {
    const values = points.channels.get(settings["Channel Name"]);
    return values ? scaledColors(values, points.count, intensityScale(values, points.count, settings)) : null;
  }
  if (transformer !== "AxisColor") return null;
  const values = axisValues(points, settings.Axis, settings["Use Fixed Frame"] === false ? null : transform);
  const bounds = settings["Autocompute Value Bounds"] ?? {};
  const [least, most] =
    bounds.Value === false ? [Number(bounds["Min Value"]), Number(bounds["Max Value"])] : rangeOf(values, points.count);
  return scaledColors(values, points.count, { least, most, isInverted: settings["Invert Rainbow"], ends: null });
}

function packedColors(values, count) {
  if (!values) return null;
  const colors = new Uint8Array(count * 3);
  for (let index = 0; index < count; index++) {
    colors[index * 3] = values[index] >>> 16;
    colors[index * 3 + 1] = values[index] >>> 8;
    colors[index * 3 + 2] = values[index];
  }
  return colors;
}

function floatColors(channels, count) {
  if (channels.includes(undefined)) return null;
  const colors = new Uint8Array(count * 3);
  channels.forEach((values, part) => {
    for (let index = 0; index < count; index++)
      colors[index * 3 + part] = Math.min(Math.max(values[index], 0), 1) * 255;
  });
  return colors;
}

function intensityScale(values, count, settings) {
  const isAutomatic = settings["Autocompute Intensity Bounds"] !== false;
  const [least, most] = isAutomatic
    ? rangeOf(values, count)
    : [Number(settings["Min Intensity"]), Number(settings["Max Intensity"])];
  const ends = settings["Use rainbow"] === false ? [rgbOf(settings["Min Color"]), rgbOf(settings["Max Color"])] : null;
  return { least, most, isInverted: settings["Invert Rainbow"], ends };
}

function scaledColors(values, count, { least, most, isInverted, ends }) {
  const colors = new Uint8Array(count * 3);
  const range = most - least || 1e20;
  for (let index = 0; index < count; index++) {
    const part = Math.min(Math.max((values[index] - least) / range, 0), 1);
    // RViz's rainbow goes from red (low) to purple (high).
    if (!ends) rainbow(isInverted ? part : 1 - part, colors, index * 3);
    else
      for (let each = 0; each < 3; each++)
        colors[index * 3 + each] = ends[0][each] + (ends[1][each] - ends[0][each]) * part;
  }
  return colors;
}

function axisValues({ positions, count }, axis, transform) {
  const at = Math.max(0, ["X", "Y", "Z"].indexOf(axis ?? "Z"));
  const values = new Float32Array(count);
  let row = [0, 0, 0];
  row[at] = 1;
  let offset = 0;
  if (transform) {
    const [x, y, z, w] = transform.q;
    row = [
      [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
      [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
      [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ][at];
    offset = transform.p[at];
  }
  for (let index = 0; index < count; index++) {
    values[index] =
      row[0] * positions[index * 3] + row[1] * positions[index * 3 + 1] + row[2] * positions[index * 3 + 2] + offset;
  }
  return values;
}

/** Return the lowest and the highest finite value. */
export function rangeOf(values, count) {
  let [least, most] = [Infinity, -Infinity];
  for (let index = 0; index < count; index++) {
    const value = values[index];
    if (value < least && value > -Infinity) least = value;
    if (value > most && value < Infinity) most = value;
  }
  return least <= most ? [least, most] : [0, 1];
}
