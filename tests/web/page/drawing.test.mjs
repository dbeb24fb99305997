// Lines of drawings and their labels.
import assert from "node:assert/strict";
import { test } from "node:test";

import { aroundLabel } from "../../../minirospy/web/dashboard/page/js/drawing.js";

const LABEL = { x: 50, y: 40, width: 30, height: 20 };

test("a line from left to right is level in its label's box", () => {
  const points = [
    { x: 0, y: 0 },
    { x: 50, y: 40 },
    { x: 100, y: 0 },
  ];
  assert.deepEqual(aroundLabel(points, LABEL, true), [points[0], { x: 35, y: 40 }, { x: 65, y: 40 }, points[2]]);
  assert.deepEqual(
    aroundLabel([...points].reverse(), LABEL, true).map(({ x }) => x),
    [100, 65, 35, 0],
  );
});

test("a line downwards is straight beside its label", () => {
  const points = [
    { x: 0, y: 0 },
    { x: 50, y: 40 },
    { x: 0, y: 80 },
  ];
  assert.deepEqual(aroundLabel(points, LABEL, false), [points[0], { x: 50, y: 30 }, { x: 50, y: 50 }, points[2]]);
});

test("the ends of a line stay, though its label is nearest to one of them", () => {
  const points = [
    { x: 40, y: 40 },
    { x: 200, y: 40 },
  ];
  const found = aroundLabel(points, LABEL, true);
  assert.deepEqual([found[0], found.at(-1)], points);
});
