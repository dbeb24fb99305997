// Points of a depth image and the info of its camera: positions in the camera's frame, z forward. Pure.
// Source: http://wiki.ros.org/rviz/DisplayTypes/DepthCloud, REP 118 (16UC1 is in millimetres, 32FC1 in metres),
// sensor_msgs/CameraInfo.

import { t } from "../texts.js";

const FORMATS = {
  __proto__: null,
  "16UC1": { size: 2, metres: 0.001, read: (view, at, isLittle) => view.getUint16(at, isLittle) },
  mono16: { size: 2, metres: 0.001, read: (view, at, isLittle) => view.getUint16(at, isLittle) },
  "32FC1": { size: 4, metres: 1, read: (view, at, isLittle) => view.getFloat32(at, isLittle) },
};

/** Return {fx, fy, cx, cy} in pixels of an image of this size. Throws Error. */
export function lensOf({ K, width, height, binning_x: acrossBinned, binning_y: alongBinned, roi }, image) {
  const across = Math.max(1, acrossBinned);
  const along = Math.max(1, alongBinned);
  const wanted = [Math.floor((roi.width || width) / across), Math.floor((roi.height || height) / along)];
  if (wanted[0] !== image.width || wanted[1] !== image.height) {
    throw new Error(
      t("Depth image size and camera info don't match: {image} vs {info}", {
        image: `${image.width} x ${image.height}`,
        info: wanted.join(" x "),
      }),
    );
  }
  const lens = {
    fx: K[0] / across,
    fy: K[4] / along,
    cx: (K[2] - roi.x_offset) / across,
    cy: (K[5] - roi.y_offset) / along,
  };
  if (![...Object.values(lens)].every(Number.isFinite) || !lens.fx || !lens.fy)
    throw new Error(t("the camera is not calibrated: K of its CameraInfo has no focal length"));
  return lens;
}

/**
 * Return the points of an image as those of a cloud are, every `stride`-th pixel; `rgba` are the pixels' colors, or
 * null. Throws Error.
 */
export function pointsOfDepth(
  { width, height, encoding, step, is_bigendian: isBig, data },
  { fx, fy, cx, cy },
  rgba = null,
  stride = 1,
) {
  const format = FORMATS[encoding];
  if (!format) throw new Error(t("Depth image has invalid format (only 16 bit and float are supported)!"));
  const need = height ? (height - 1) * step + width * format.size : 0;
  if (step < width * format.size || data.length < need)
    throw new Error(
      t("the image has {size} bytes, {encoding} of {width} x {height} needs {need}", {
        size: data.length,
        encoding,
        width,
        height,
        need,
      }),
    );

  const total = width * height;
  const most = Math.ceil(total / stride);
  const positions = new Float32Array(most * 3);
  const rgb = rgba && new Uint32Array(most);
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  let count = 0;
  for (let pixel = 0; pixel < total; pixel += stride) {
    const x = pixel % width;
    const y = (pixel - x) / width;
    const depth = format.read(view, y * step + x * format.size, !isBig) * format.metres;
    // 0, infinity and what is not a number: nothing was measured.
    if (!(depth > 0 && depth < Infinity)) continue;
    positions[count * 3] = ((x - cx) / fx) * depth;
    positions[count * 3 + 1] = ((y - cy) / fy) * depth;
    positions[count * 3 + 2] = depth;
    if (rgb) rgb[count] = (rgba[pixel * 4] << 16) | (rgba[pixel * 4 + 1] << 8) | rgba[pixel * 4 + 2];
    count += 1;
  }
  const channels = new Map(rgb ? [["rgb", rgb.subarray(0, count)]] : []);
  return { count, total, positions: positions.subarray(0, count * 3), channels };
}
