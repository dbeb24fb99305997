// Images of each encoding, with the values that OpenCV gives (tests/core/images/record_colors.py).
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { deflateSync } from "node:zlib";

import { decompressed } from "../../../minirospy/web/dashboard/page/js/compressed.js";
import { COLOR_MAPS, pixelsOf } from "../../../minirospy/web/dashboard/page/js/pixels.js";
import { deepPng, valuesOfPng } from "../../../minirospy/web/dashboard/page/js/png.js";

const { encodings, png } = JSON.parse(readFileSync(new URL("../../core/images/colors.json", import.meta.url), "utf8"));
const fileOf = (name) => Uint8Array.from(atob(png[name].file), (letter) => letter.charCodeAt(0));

function messageOf(encoding, rows, isBig) {
  const size = encoding.includes("16") ? 2 : 1;
  const values = rows.flat(2);
  const bytes = new Uint8Array(values.length * size);
  const view = new DataView(bytes.buffer);
  values.forEach((value, at) => (size === 2 ? view.setUint16(at * 2, value, !isBig) : view.setUint8(at, value)));
  const [height, width] = [rows.length, rows[0].length];
  return { width, height, encoding, is_bigendian: Number(isBig), step: bytes.length / height, data: bytes };
}

for (const [encoding, { data, bgr }] of Object.entries(encodings)) {
  test(`${encoding} has OpenCV's colors`, () => {
    const expected = bgr.flat().map(([blue, green, red]) => [red, green, blue, 255]);
    for (const isBig of encoding.includes("16") ? [false, true] : [false]) {
      const { rgba } = pixelsOf(messageOf(encoding, data, isBig));
      const found = expected.map((_, at) => Array.from(rgba.subarray(at * 4, at * 4 + 4)));
      assert.deepEqual(found, expected);
    }
  });
}

test("PNG files of 16 bits keep their values", async () => {
  for (const name of ["gray", "bgr steps", "bgr noise"]) {
    const values = new DataView((await valuesOfPng(fileOf(name))).buffer);
    // OpenCV's arrays are BGR, the file's are RGB.
    const expected = png[name].values.flat().flatMap((each) => (Array.isArray(each) ? each.toReversed() : [each]));
    assert.deepEqual(
      expected.map((_, at) => values.getUint16(at * 2)),
      expected,
    );
  }
  assert.equal(deepPng(new Uint8Array(100)), null);
  await assert.rejects(valuesOfPng(fileOf("gray").subarray(0, 60)));
});

test("a small PNG file that inflates without end is read as far as its size", async () => {
  const file = fileOf("gray");
  const head = file.slice(0, 33);
  new DataView(head.buffer).setUint32(16, 1);
  new DataView(head.buffer).setUint32(20, 1);
  const bomb = deflateSync(new Uint8Array(50_000_000));
  const chunk = new Uint8Array(12 + bomb.length);
  new DataView(chunk.buffer).setUint32(0, bomb.length);
  chunk.set(
    [..."IDAT"].map((letter) => letter.charCodeAt(0)),
    4,
  );
  chunk.set(bomb, 8);

  const Inflater = globalThis.DecompressionStream;
  let inflated = 0;
  globalThis.DecompressionStream = class {
    constructor(format) {
      const { readable, writable } = new Inflater(format);
      const count = new TransformStream({
        transform(data, controller) {
          inflated += data.length;
          controller.enqueue(data);
        },
      });
      Object.assign(this, { readable: readable.pipeThrough(count), writable });
    }
  };
  try {
    const values = await valuesOfPng(Uint8Array.from([...head, ...chunk]));
    assert.deepEqual([...values], [0, 0]);
  } finally {
    globalThis.DecompressionStream = Inflater;
  }
  assert.ok(inflated < 5_000_000, `${inflated} bytes`);
});

test("a compressed image of 16 bits is an image of numbers or of colors", async () => {
  const image = await decompressed({ data: fileOf("gray"), format: "16UC1; png compressed " });
  assert.equal(image.encoding, "16UC1");
  assert.equal(pixelsOf(image).at(1, 2), String(png.gray.values[2][1]));
  const { range } = pixelsOf(image);
  assert.deepEqual(range, [Math.min(...png.gray.values.flat()), Math.max(...png.gray.values.flat())]);

  const colors = await decompressed({ data: fileOf("bgr noise"), format: "bgr16; png compressed bgr16" });
  const [blue, green, red] = png["bgr noise"].values[1][3];
  assert.equal(pixelsOf(colors).at(3, 1), `${red} ${green} ${blue}`);
});

test("compressedDepth has a header, and floats are stored as inverse depths", async () => {
  const head = new Uint8Array(12);
  new DataView(head.buffer).setFloat32(4, 10100, true);
  new DataView(head.buffer).setFloat32(8, -1009, true);
  const data = new Uint8Array([...head, ...fileOf("gray")]);
  const millimetres = await decompressed({ data, format: "16UC1; compressedDepth png" });
  assert.equal(pixelsOf(millimetres).at(0, 0), String(png.gray.values[0][0]));
  const metres = await decompressed({ data, format: "32FC1; compressedDepth" });
  assert.equal(metres.encoding, "32FC1");
  const inverse = png.gray.values[4][6];
  assert.equal(pixelsOf(metres).at(6, 4), (10100 / (inverse + 1009)).toPrecision(5));
  const other = { data: head, format: "32FC1; compressedDepth rvl" };
  await assert.rejects(decompressed(other), /cannot be shown by this browser/);
});

test("numbers have the colors of the chosen map, from the lowest to the highest", () => {
  const message = messageOf("16UC1", [[1000, 2000, 3000]], false);
  const colorsOf = (map) => {
    const { rgba } = pixelsOf(message, null, null, map);
    return [0, 1, 2].map((at) => Array.from(rgba.subarray(at * 4, at * 4 + 3)));
  };
  assert.deepEqual(colorsOf("gray"), [
    [0, 0, 0],
    [128, 128, 128],
    [255, 255, 255],
  ]);
  assert.deepEqual(colorsOf("turbo"), [
    [48, 18, 59],
    [164, 252, 60],
    [122, 4, 3],
  ]);
  assert.deepEqual(colorsOf("heat")[0], [0, 0, 0]);
  assert.deepEqual(colorsOf("rainbow")[0], [255, 0, 0]);
  assert.deepEqual(colorsOf("constructor"), colorsOf("gray"));
  assert.deepEqual(Object.keys(COLOR_MAPS), ["gray", "turbo", "rainbow", "heat"]);
});
