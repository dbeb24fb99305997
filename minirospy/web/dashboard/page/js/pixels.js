// sensor_msgs/Image becomes RGBA, with the values that OpenCV and cv_bridge give. Pure. Source:
// sensor_msgs/image_encodings.h, REP 118 (depth), https://docs.opencv.org (cvtColor).

import { rainbow } from "./scene/colors.js";

const BAYER = { rggb: [0, 1, 1, 2], bggr: [2, 1, 1, 0], gbrg: [1, 2, 0, 1], grbg: [1, 0, 2, 1] };

/**
 * Return {width, height, rgba, range, at(x, y) -> text} of a message; range: [low, high] of what is no color.
 * Throws Error.
 * Numbers such as depths are black to white from `low` to `high`, or have the colors of a map in COLOR_MAPS; if one is
 * null, from the lowest or to the highest. */
export function pixelsOf(
  { width, height, encoding, is_bigendian: isBig, step, data },
  low = null,
  high = null,
  map = "gray",
) {
  const kind = kindOf(encoding);
  const need = height ? (height - 1) * step + width * kind.bytes : 0;
  if (step < width * kind.bytes || data.length < need)
    throw new Error(`the image has ${data.length} bytes, ${encoding} of ${width} x ${height} needs ${need}`);
  const rgba = new Uint8ClampedArray(width * height * 4);
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  const read = (offset) => kind.get(view, offset, !isBig);
  const colored = COLOR_MAPS[map] ?? COLOR_MAPS.gray;
  let range = null;
  if (kind.isScaled) {
    range = low !== null && high !== null ? [low, high] : rangeOf(width, height, step, kind, read);
    range = [low ?? range[0], high ?? range[1]];
  }
  for (let y = 0, to = 0; y < height; y++) {
    for (let x = 0; x < width; x++, to += 4) {
      const place = { read, range, colored, x, y, step, width, height };
      kind.put(rgba, to, data, y * step + x * kind.bytes, place);
    }
  }
  const at = (x, y) => {
    const parts = Array.from({ length: kind.channels }, (_, channel) =>
      read(y * step + x * kind.bytes + channel * kind.size),
    );
    return parts.map((each) => (Number.isInteger(each) ? each : each.toPrecision(5))).join(" ");
  };
  return { width, height, rgba, range, at };
}

function rangeOf(width, height, step, kind, read) {
  let low = Infinity;
  let high = -Infinity;
  for (let y = 0; y < height; y++) {
    for (let x = 0; x < width; x++) {
      const value = read(y * step + x * kind.bytes);
      if (!Number.isFinite(value)) continue;
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  return low <= high ? [low, high] : [0, 1];
}

const GETTERS = {
  "8U": [1, (v, o) => v.getUint8(o)],
  "8S": [1, (v, o) => v.getInt8(o)],
  "16U": [2, (v, o, l) => v.getUint16(o, l)],
  "16S": [2, (v, o, l) => v.getInt16(o, l)],
  "32S": [4, (v, o, l) => v.getInt32(o, l)],
  "32F": [4, (v, o, l) => v.getFloat32(o, l)],
  "64F": [8, (v, o, l) => v.getFloat64(o, l)],
};

function kindOf(encoding) {
  const color = /^(rgb|bgr|rgba|bgra)(8|16)$/.exec(encoding);
  if (color) return colors(color[1], Number(color[2]) / 8);
  if (encoding === "mono8" || encoding === "8UC1") {
    return { ...base("8U", 1), put: (rgba, to, data, from) => put(rgba, to, data[from], data[from], data[from]) };
  }
  // cv_bridge shows numbers of three or four channels as colors of OpenCV's order.
  const channels = /^(8|16)UC([34])$/.exec(encoding);
  if (channels) return colors(channels[2] === "3" ? "bgr" : "bgra", Number(channels[1]) / 8);
  const bayer = /^bayer_(\w{4})(8|16)$/.exec(encoding);
  if (bayer && Object.hasOwn(BAYER, bayer[1])) return mosaic(BAYER[bayer[1]], Number(bayer[2]));
  if (["yuv422", "uyvy", "yuv422_yuy2", "yuyv"].includes(encoding))
    return luminance(encoding === "yuv422" || encoding === "uyvy" ? 0 : 1);
  const numbers = encoding === "mono16" ? ["", "16U", "1"] : /^(8S|16U|16S|32S|32F|64F)C([1-4])$/.exec(encoding);
  if (numbers) {
    return {
      ...base(numbers[1], Number(numbers[2])),
      isScaled: true,
      put(rgba, to, data, from, { read, range: [low, high], colored }) {
        const value = read(from);
        // What is not a number has no depth: dark blue.
        if (!Number.isFinite(value)) return put(rgba, to, 20, 24, 60);
        rgba[to + 3] = 255;
        return colored(high > low ? (value - low) / (high - low) : 0.5, rgba, to);
      },
    };
  }
  throw new Error(`images of encoding ${encoding} cannot be shown`);
}

function base(name, channels) {
  const [size, get] = GETTERS[name];
  return { size, get, channels, bytes: size * channels, isScaled: false };
}

function put(rgba, to, red, green, blue) {
  rgba[to] = red;
  rgba[to + 1] = green;
  rgba[to + 2] = blue;
  rgba[to + 3] = 255;
}

function colors(order, size) {
  const [red, green, blue] = ["r", "g", "b"].map((each) => order.indexOf(each) * size);
  if (size === 1)
    return {
      ...base("8U", order.length),
      put: (rgba, to, data, from) => put(rgba, to, data[from + red], data[from + green], data[from + blue]),
    };
  return {
    ...base("16U", order.length),
    put: (rgba, to, data, from, { read }) =>
      put(rgba, to, eightBits(read(from + red)), eightBits(read(from + green)), eightBits(read(from + blue))),
  };
}

const eightBits = (value) => Math.round(value / 257);

// Of the colors that a pixel lacks, the mean of its neighbors that have them. As in OpenCV, the outermost pixels have
// the colors of those next to them.
function mosaic(pattern, bits) {
  const channelAt = (x, y) => pattern[(y & 1) * 2 + (x & 1)];
  const size = bits / 8;
  return {
    ...base(bits === 16 ? "16U" : "8U", 1),
    put(rgba, to, data, from, { read, x, y, step, width, height }) {
      const column = width > 2 ? Math.min(Math.max(x, 1), width - 2) : x;
      const row = height > 2 ? Math.min(Math.max(y, 1), height - 2) : y;
      const sums = [0, 0, 0];
      const counts = [0, 0, 0];
      const own = channelAt(column, row);
      for (let below = Math.max(0, row - 1); below <= Math.min(height - 1, row + 1); below++) {
        for (let beside = Math.max(0, column - 1); beside <= Math.min(width - 1, column + 1); beside++) {
          const channel = channelAt(beside, below);
          // Of a green pixel's neighbors, only those in its row and column are red and blue.
          if (channel === own && (beside !== column || below !== row)) continue;
          sums[channel] += read(below * step + beside * size);
          counts[channel] += 1;
        }
      }
      const color = sums.map((sum, channel) => {
        const mean = counts[channel] ? Math.floor(sum / counts[channel] + 0.5) : 0;
        return bits === 16 ? eightBits(mean) : mean;
      });
      put(rgba, to, ...color);
    },
  };
}

// Two pixels share their color: U Y V Y, or Y U Y V. The factors of ITU-R BT.601 in steps of 2 ** -20, as in OpenCV.
function luminance(first) {
  return {
    ...base("8U", 2),
    put(rgba, to, data, from, { x }) {
      const pair = from - (x & 1) * 2;
      const luma = Math.max(0, data[from + (first ? 0 : 1)] - 16) * 1220542 + (1 << 19);
      const u = data[pair + (first ? 1 : 0)] - 128;
      const v = data[pair + (first ? 3 : 2)] - 128;
      put(rgba, to, (luma + 1673527 * v) >> 20, (luma - 852492 * v - 409993 * u) >> 20, (luma + 2116026 * u) >> 20);
    },
  };
}

// Colors from dark blue over green to dark red, in eight equal steps.
const TURBO = [
  [48, 18, 59],
  [70, 107, 227],
  [41, 187, 236],
  [49, 242, 153],
  [164, 252, 60],
  [237, 208, 58],
  [251, 128, 34],
  [210, 49, 5],
  [122, 4, 3],
];

/** Functions that write the color of a value from 0 to 1 into three bytes. */
export const COLOR_MAPS = {
  __proto__: null,
  gray(value, into, at) {
    into[at] = into[at + 1] = into[at + 2] = value * 255;
  },
  turbo(value, into, at) {
    const place = Math.min(Math.max(value, 0), 1) * (TURBO.length - 1);
    const low = Math.min(Math.floor(place), TURBO.length - 2);
    for (let each = 0; each < 3; each++)
      into[at + each] = TURBO[low][each] + (place - low) * (TURBO[low + 1][each] - TURBO[low][each]);
  },
  // As RViz colors intensities: the lowest are red.
  rainbow: (value, into, at) => rainbow(1 - value, into, at),
  heat(value, into, at) {
    for (let each = 0; each < 3; each++) into[at + each] = (value * 3 - each) * 255;
  },
};
