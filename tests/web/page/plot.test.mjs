// What the plot computes: samples, what is drawn of them, derived series, paths of fields, rates.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

import { derivedOf, pairs, rangeOf } from "../../../minirospy/web/dashboard/page/js/derived.js";
import {
  anglesOf,
  canLead,
  namedSteps,
  numericPaths,
  parseSteps,
  select,
} from "../../../minirospy/web/dashboard/page/js/paths.js";
import { Rate } from "../../../minirospy/web/dashboard/page/js/rates.js";
import { parseDefinition } from "../../../minirospy/web/dashboard/page/js/ros1.js";
import { drawn, MAX_POINTS, Samples } from "../../../minirospy/web/dashboard/page/js/samples.js";
import { STEPS, tickTexts } from "../../../minirospy/web/dashboard/page/js/ticks.js";

const samplesOf = (points) => {
  const samples = new Samples();
  samples.append(
    points.map(([time]) => time),
    points.map(([, value]) => value),
  );
  return samples;
};

test("few points are drawn as they are, and the last of one time counts", () => {
  const samples = samplesOf([
    [1, 10],
    [2, 20],
    [2, 21],
    [3, NaN],
  ]);
  assert.deepEqual(drawn([samples], 0, 10, 100, 1), [
    [0, 1, 2],
    [10, 21, null],
  ]);
});

test("of many points each column shows the extremes", () => {
  const count = 100_000;
  const times = Float64Array.from({ length: count }, (_, index) => index / 1000);
  const values = Float64Array.from({ length: count }, (_, index) => (index === 54_321 ? 7 : Math.sin(index)));
  const samples = new Samples();
  samples.append(times, values);
  const [xs, ys] = drawn([samples], 0, 100, 200, 0);
  assert.ok(xs.length <= 402);
  assert.equal(Math.max(...ys.filter(Number.isFinite)), 7);
});

test("the oldest quarter goes when a series is full", () => {
  const samples = new Samples();
  const part = new Float64Array(MAX_POINTS / 4);
  for (let number = 0; number < 5; number++) samples.append(part.fill(number), part);
  assert.equal(samples.count, MAX_POINTS);
  assert.equal(samples.firstTime, 1);
  assert.equal(samples.total, (MAX_POINTS / 4) * 5);
});

test("a derivative and an average stream", () => {
  const derivative = derivedOf("derivative");
  assert.deepEqual([...derivative.append([1, 2], [5, 7])], [NaN, 2]);
  assert.deepEqual([...derivative.append([4], [7])], [0]);
  assert.deepEqual([...derivedOf("average1").append([0, 0.5, 2], [1, 3, 9])], [1, 2, 9]);
  assert.equal(derivedOf(""), null);
});

test("one series over another pairs values of the same moment", () => {
  const over = samplesOf([
    [0, 100],
    [2, 200],
  ]);
  const samples = samplesOf([
    [1, 1],
    [2, 2],
    [3, 3],
  ]);
  assert.deepEqual(pairs(over, samples, 0, 10, 10), [
    [100, 200, 200],
    [1, 2, 3],
  ]);
});

test("an axis has a margin, also if all values are the same", () => {
  assert.deepEqual(rangeOf([[0, 10]]), [-0.5, 10.5]);
  assert.deepEqual(rangeOf([[NaN]]), [0, 1]);
  const [low, high] = rangeOf([[5]]);
  assert.ok(low < 5 && high > 5);
});

test("paths lead to fields, elements, slices and what a filter finds", () => {
  const found = (path, message) => {
    const values = [];
    select(message, parseSteps(path), (label, value) => values.push([label, value]));
    return values;
  };
  assert.deepEqual(found(".pose.x", { pose: { x: 3 } }), [["/pose/x", 3]]);
  assert.deepEqual(found("/ranges[-1]", { ranges: [1, 2, 3] }), [["/ranges[-1]", 3]]);
  assert.deepEqual(
    found("/ranges[0:2]", { ranges: [1, 2, 3] }).map(([, value]) => value),
    [1, 2],
  );
  const markers = [
    { id: 1, x: 5 },
    { id: 2, x: 6 },
  ];
  assert.deepEqual(
    found("/m[:]{id==2}/x", { m: markers }).map(([, value]) => value),
    [6],
  );
  assert.deepEqual(found("/constructor", {}), []);
  assert.throws(() => parseSteps("/a[x"), /is not a field/);
});

// introspect/field_series.py reads the same table.
const PATHS = JSON.parse(readFileSync(new URL("paths.json", import.meta.url), "utf-8"));

for (const [path, wanted] of Object.entries(PATHS.series)) {
  test(`the path ${path} finds its numbers`, () => {
    const found = {};
    select(PATHS.message, parseSteps(path), (label, value) => (found[label] = value));
    assert.deepEqual(Object.keys(found), Object.keys(wanted));
    for (const [label, value] of Object.entries(wanted)) assert.ok(Math.abs(found[label] - value) < 1e-7, label);
  });
}

test("paths with wrong syntax are refused", () => {
  for (const path of PATHS.refused) assert.throws(() => parseSteps(path), /is not a field/, path);
});

test("long paths are refused", () => {
  assert.throws(() => parseSteps("[" + "a".repeat(16_000)), /characters/);
  assert.throws(() => parseSteps("/a".repeat(51)), /steps/);
  assert.throws(() => parseSteps(`/a[${"9".repeat(10)}]`), /is not a field/);
  assert.throws(() => parseSteps(`/a[:${"9".repeat(10)}]`), /is not a field/);
  assert.equal(parseSteps("/a".repeat(50)).length, 50);
});

test("paths by joint name and by angle are compared with the type", () => {
  const definition = parseDefinition(
    "a/B",
    "string[] name\nfloat64[] position\nQ turn\nQ[] turns\nO own\nfloat64[] name2\n" +
      `${"=".repeat(80)}\nMSG: a/Q\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n` +
      `${"=".repeat(80)}\nMSG: a/O\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\nfloat32 yaw\n`,
  );
  const can = (path) => canLead(definition, parseSteps(path));
  for (const path of ["/position[elbow]", "/turns[elbow]", "/turn/yaw", "/turns[0]/roll", "/own/yaw", "/own/pitch"])
    assert.ok(can(path), path);
  for (const path of ["/turn[elbow]", "/turn/yaw/x", "/turns/yaw", "/turn/heading", "/position[0][elbow]"])
    assert.equal(can(path), false, path);
  const paths = numericPaths(definition);
  assert.deepEqual(paths.slice(1, 5), ["/turn/roll", "/turn/pitch", "/turn/yaw", "/turn/x"]);
  assert.equal(paths.filter((path) => path === "/own/yaw").length, 1);
});

test("elements have the names beside their array, if these belong to them", () => {
  assert.deepEqual(namedSteps(["elbow", "3", "a:b"], [1, 2, 3]), ["[elbow]", '["3"]', '["a:b"]']);
  assert.equal(namedSteps(["elbow", "elbow"], [1, 2]), null);
  assert.equal(namedSteps(["elbow"], [1, 2]), null);
  assert.equal(namedSteps(["a]"], [1]), null);
  assert.equal(namedSteps("ab", [1, 2]), null);
  assert.deepEqual(anglesOf({ x: 0, y: 0, z: 0, w: 1 }), ["roll", "pitch", "yaw"]);
  assert.deepEqual(anglesOf({ x: 0, y: 0, z: 0, w: 1, yaw: 3 }), ["roll", "pitch"]);
  assert.deepEqual(anglesOf({ x: 0, y: 0, z: 0 }), []);
});

test("the numbers of an axis are told apart by as few digits as possible", () => {
  assert.deepEqual(tickTexts([0.1, 0.2, 0.1 + 0.2], 0.1), ["0.1", "0.2", "0.3"]);
  assert.deepEqual(tickTexts([-0.5, -5.5e-17, 0.5], 0.5), ["-0.5", "0.0", "0.5"]);
  assert.deepEqual(tickTexts([0, 50, 100], 50), ["0", "50", "100"]);
  assert.deepEqual(tickTexts([0.0002, 0.0004], 0.0002), ["0.0002", "0.0004"]);
  assert.deepEqual(tickTexts([0, 2e-8, 4e-8], 2e-8), ["0", "2e-8", "4e-8"]);
  assert.deepEqual(tickTexts([0, 5e5, 1e6, 1.5e6], 5e5), ["0", "0.5e6", "1.0e6", "1.5e6"]);
  assert.deepEqual(tickTexts([1e9, 2e9], 1e9), ["1e9", "2e9"]);
  // Of a stamp, the first number is shown in full.
  assert.deepEqual(tickTexts([1700000000.1, 1700000000.2, 1700000000.3], 0.1), ["1700000000.1", "+0.1", "+0.2"]);
  assert.deepEqual(tickTexts([-1700000002, -1700000001], 1), ["-1700000002", "+1"]);
  assert.deepEqual(tickTexts([], 1), []);
  // Of a range too small for any step, uPlot has the step 0.
  assert.deepEqual(tickTexts([1, 2], 0), ["1", "2"]);
  assert.deepEqual(tickTexts([0, 1e-30], 1e-30), ["0", "1e-30"]);
  assert.ok(STEPS.every((step, index) => index === 0 || step > STEPS[index - 1]));
  assert.deepEqual(
    STEPS.filter((step) => step >= 0.1 && step <= 10),
    [0.1, 0.2, 0.5, 1, 2, 5, 10],
  );
});

test("paths of a definition are those of numbers", () => {
  const definition = parseDefinition("a/B", "float64 x\nstring s\nfloat32[] list");
  assert.ok(numericPaths(definition).some((path) => /x$/.test(String(path.path ?? path))));
  assert.equal(Boolean(canLead(definition, parseSteps("/x"))), true);
  assert.equal(Boolean(canLead(definition, parseSteps("/y"))), false);
});

test("a rate is known after half a second and two messages", () => {
  const rate = new Rate();
  assert.equal(rate.at(0), null);
  rate.add(0, 1, 10);
  assert.equal(rate.at(2), null);
  for (let tick = 1; tick <= 20; tick++) rate.add(tick / 10, 1, 10);
  assert.deepEqual(rate.at(2), { hz: 10, bytes: 100 });
  assert.equal(rate.at(60).hz, 0);
});
