// PNG files with 16 bits per channel, which browsers reduce to 8. Pure, but for DecompressionStream. Source: PNG (third
// edition).

const SIGNATURE = [0x89, 0x50, 0x4e, 0x47];
const HEAD = 33; // bytes of the signature and of IHDR
const CHANNELS = { 0: 1, 2: 3, 4: 2, 6: 4 }; // by color type
const MAX_PIXELS = 100_000_000; // as on the server: a small file can have many more

/** Return {width, height, channels} of a PNG of 16 bits per channel, or null for other files. */
export function deepPng(data) {
  if (data.length < HEAD || SIGNATURE.some((byte, at) => data[at] !== byte)) return null;
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  const channels = CHANNELS[data[25]];
  if (data[24] !== 16 || !channels || data[28] !== 0) return null;
  return { width: view.getUint32(16), height: view.getUint32(20), channels };
}

/** Return a promise of the values of such a file, as big-endian bytes without padding. Rejects with an Error. */
export async function valuesOfPng(data) {
  const { width, height, channels } = deepPng(data);
  if (width * height > MAX_PIXELS) throw new Error(`an image of ${width} x ${height} pixels is too large`);
  const view = new DataView(data.buffer, data.byteOffset, data.byteLength);
  const parts = [];
  for (let at = 8; at + 8 <= data.length;) {
    const length = view.getUint32(at);
    const kind = String.fromCharCode(...data.subarray(at + 4, at + 8));
    if (kind === "IDAT") parts.push(data.subarray(at + 8, at + 8 + length));
    if (kind === "IEND") break;
    at += 12 + length;
  }
  const stream = new Blob(parts).stream().pipeThrough(new DecompressionStream("deflate"));
  const row = width * channels * 2;
  return unfiltered(await firstBytes(stream, (row + 1) * height), row, height, channels * 2);
}

/** Return the first bytes of a stream, at most `most`. A small file may inflate to gigabytes. */
async function firstBytes(stream, most) {
  const reader = stream.getReader();
  const chunks = [];
  let size = 0;
  while (size < most) {
    const { done, value } = await reader.read();
    if (done) break;
    chunks.push(value);
    size += value.length;
  }
  await reader.cancel();
  return new Uint8Array(await new Blob(chunks).arrayBuffer());
}

/** Undo the filter of each row; `size` is the number of bytes of a pixel. */
function unfiltered(bytes, row, height, size) {
  if (bytes.length < (row + 1) * height) throw new Error("the PNG file is not complete");
  const found = new Uint8Array(row * height);
  for (let y = 0; y < height; y++) {
    const filter = bytes[y * (row + 1)];
    const from = y * (row + 1) + 1;
    const to = y * row;
    for (let x = 0; x < row; x++) {
      const left = x >= size ? found[to + x - size] : 0;
      const up = y ? found[to + x - row] : 0;
      const corner = x >= size && y ? found[to + x - row - size] : 0;
      const added = [0, left, up, (left + up) >> 1, filter === 4 ? nearest(left, up, corner) : 0][filter] ?? 0;
      found[to + x] = bytes[from + x] + added;
    }
  }
  return found;
}

/** Return what is nearest to left + up - corner, as the filter Paeth does. */
function nearest(left, up, corner) {
  const guess = left + up - corner;
  const [a, b, c] = [Math.abs(guess - left), Math.abs(guess - up), Math.abs(guess - corner)];
  if (a <= b && a <= c) return left;
  return b <= c ? up : corner;
}
