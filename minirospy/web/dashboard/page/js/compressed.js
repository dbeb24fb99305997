// sensor_msgs/CompressedImage: pictures that the browser decodes, 16-bit PNGs, and depths of compressedDepth.

import { deepPng, valuesOfPng } from "./png.js";
import { t } from "./texts.js";

const DEPTH_HEADER = 12; // bytes: an enum, and the two numbers that make depths of inverse depths

/**
 * Return a promise of {bitmap, width, height}, or of a sensor_msgs/Image whose values a bitmap cannot have. Rejects
 * with an Error.
 */
export async function decompressed({ data, format }) {
  const [encoding, rest = ""] = format.split(";").map((part) => part.trim());
  if (rest.includes("compressedDepth")) return depthsOf(data, encoding, format);
  const deep = deepPng(data);
  if (deep) return imageOf(deep, await valuesOfPng(data), encodingOf(deep.channels, encoding));
  try {
    const bitmap = await createImageBitmap(new Blob([data]));
    return { width: bitmap.width, height: bitmap.height, bitmap, range: null };
  } catch {
    throw new Error(t('a compressed image of format "{format}" cannot be shown by this browser', { format }));
  }
}

// A PNG file has its colors in the order RGB, whatever the original had.
function encodingOf(channels, original) {
  if (channels === 1) return /^(mono16|bayer_\w{4}16|16SC1)$/.test(original) ? original : "16UC1";
  return { 2: "16UC2", 3: "rgb16", 4: "rgba16" }[channels];
}

function imageOf({ width, height, channels }, values, encoding) {
  return { width, height, encoding, is_bigendian: 1, step: width * channels * 2, data: values };
}

async function depthsOf(data, encoding, format) {
  const file = data.subarray(DEPTH_HEADER);
  const deep = deepPng(file);
  if (!deep || deep.channels !== 1)
    throw new Error(t('a compressed image of format "{format}" cannot be shown by this browser', { format }));
  const values = await valuesOfPng(file);
  if (encoding !== "32FC1") return imageOf(deep, values, "16UC1");

  const head = new DataView(data.buffer, data.byteOffset, DEPTH_HEADER);
  const [a, b] = [head.getFloat32(4, true), head.getFloat32(8, true)];
  const view = new DataView(values.buffer);
  const depths = new DataView(new ArrayBuffer(values.length * 2));
  for (let at = 0; at < values.length; at += 2) {
    const inverse = view.getUint16(at);
    depths.setFloat32(at * 2, inverse ? a / (inverse - b) : NaN, true);
  }
  return {
    ...imageOf(deep, new Uint8Array(depths.buffer), "32FC1"),
    is_bigendian: 0,
    step: deep.width * 4,
  };
}
