// sensor_msgs/Image becomes RGBA. Pure. Source: sensor_msgs/image_encodings.h, REP 118 (depth).

const BAYER = { rggb: [0, 1, 1, 2], bggr: [2, 1, 1, 0], gbrg: [1, 2, 0, 1], grbg: [1, 0, 2, 1] };

/**
 * Return {width, height, rgba, range, at(x, y) -> text} of a message; range: [low, high] of what is no color.
 * Throws Error.
 * Numbers such as depths are black to white from `low` to `high`; if one is null, from the lowest or to the
 * highest. */
export function pixelsOf({ width, height, encoding, is_bigendian: isBig, step, data }, low = null, high = null) {
  const kind = kindOf(encoding);
  const need = height ? (height - 1) * step + width * kind.bytes : 0;
  if (step < width * kind.bytes || data.length < need)
    throw new Error(`the image has ${data.length} bytes, ${encoding} of ${width} x ${height} needs ${need}`);
  const rgba = new Uint8ClampedArray(width * height * 4);
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  const read = (offset) => kind.get(view, offset, !isBig);
  let range = null;
  if (kind.isScaled) {
    range = low !== null && high !== null ? [low, high] : rangeOf(width, height, step, kind, read);
    range = [low ?? range[0], high ?? range[1]];
  }
  for (let y = 0, to = 0; y < height; y++) {
    for (let x = 0; x < width; x++, to += 4)
      kind.put(rgba, to, data, y * step + x * kind.bytes, { read, range, x, y, step, width, height });
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
  if (encoding === "8UC3") return colors("bgr", 1);
  if (encoding === "8UC4") return colors("bgra", 1);
  const bayer = /^bayer_(\w{4})8$/.exec(encoding);
  if (bayer && Object.hasOwn(BAYER, bayer[1])) return mosaic(BAYER[bayer[1]]);
  if (["yuv422", "uyvy", "yuv422_yuy2", "yuyv"].includes(encoding))
    return luminance(encoding === "yuv422" || encoding === "uyvy" ? 0 : 1);
  const numbers = encoding === "mono16" ? ["", "16U", "1"] : /^(8S|16U|16S|32S|32F|64F)C([1-4])$/.exec(encoding);
  if (numbers) {
    return {
      ...base(numbers[1], Number(numbers[2])),
      isScaled: true,
      put(rgba, to, data, from, { read, range: [low, high] }) {
        const value = read(from);
        // What is not a number has no depth: dark blue.
        if (!Number.isFinite(value)) return put(rgba, to, 20, 24, 60);
        const gray = high > low ? ((value - low) / (high - low)) * 255 : 128;
        return put(rgba, to, gray, gray, gray);
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
      put(rgba, to, read(from + red) >> 8, read(from + green) >> 8, read(from + blue) >> 8),
  };
}

// Of the colors that a pixel lacks, the mean of its neighbors that have them.
function mosaic(pattern) {
  const channelAt = (x, y) => pattern[(y & 1) * 2 + (x & 1)];
  return {
    ...base("8U", 1),
    put(rgba, to, data, from, { x, y, step, width, height }) {
      const sums = [0, 0, 0];
      const counts = [0, 0, 0];
      const own = channelAt(x, y);
      for (let row = Math.max(0, y - 1); row <= Math.min(height - 1, y + 1); row++) {
        for (let column = Math.max(0, x - 1); column <= Math.min(width - 1, x + 1); column++) {
          const channel = channelAt(column, row);
          sums[channel] += data[row * step + column];
          counts[channel] += 1;
        }
      }
      const color = sums.map((sum, channel) =>
        channel === own ? data[from] : counts[channel] ? sum / counts[channel] : 0,
      );
      put(rgba, to, ...color);
    },
  };
}

// Two pixels share their color: U Y V Y, or Y U Y V.
function luminance(first) {
  return {
    ...base("8U", 2),
    put(rgba, to, data, from, { x }) {
      const pair = from - (x & 1) * 2;
      const luma = data[from + (first ? 0 : 1)];
      const u = data[pair + (first ? 1 : 0)] - 128;
      const v = data[pair + (first ? 3 : 2)] - 128;
      put(rgba, to, luma + 1.402 * v, luma - 0.344136 * u - 0.714136 * v, luma + 1.772 * u);
    },
  };
}
