// What the plot computes: samples, what is drawn of them, derived series, paths of fields, rates.
import assert from "node:assert/strict";
import { test } from "node:test";

import { derivedOf, pairs, rangeOf } from "../../../minirospy/web/dashboard/page/js/derived.js";
import { canLead, numericPaths, parseSteps, select } from "../../../minirospy/web/dashboard/page/js/paths.js";
import { Rate } from "../../../minirospy/web/dashboard/page/js/rates.js";
import { parseDefinition } from "../../../minirospy/web/dashboard/page/js/ros1.js";
import { drawn, MAX_POINTS, Samples } from "../../../minirospy/web/dashboard/page/js/samples.js";

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
  assert.throws(() => parseSteps("/a[x]"), /is not a field/);
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
