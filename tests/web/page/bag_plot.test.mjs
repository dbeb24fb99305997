// Series of bags: their paths, and the points of a part in place of those of the whole.
import assert from "node:assert/strict";
import { test } from "node:test";

import { BagPlot, bagPathOf, refined, suffices } from "../../../minirospy/web/dashboard/page/js/bag_plot.js";

test("a path of a bag names the bag, and what is subtracted", () => {
  assert.equal(bagPathOf("/odom/pose/x"), null);
  assert.equal(bagPathOf("/odom.bag/x"), null);
  assert.deepEqual(bagPathOf("run.bag:/odom/x"), { bag: "run.bag", path: "/odom/x", minus: null });
  assert.deepEqual(bagPathOf("/data/my run.mcap:/a/b[elbow]"), {
    bag: "/data/my run.mcap",
    path: "/a/b[elbow]",
    minus: null,
  });
  assert.deepEqual(bagPathOf("C:\\data\\run.bag:/a/b").bag, "C:\\data\\run.bag");
  assert.deepEqual(bagPathOf("run.bag:/a/x - /b/x"), {
    bag: "run.bag",
    path: "/a/x",
    minus: { bag: "run.bag", path: "/b/x" },
  });
  assert.deepEqual(bagPathOf("a/run.bag:/a/x - b/run 2.bag:/b/x"), {
    bag: "a/run.bag",
    path: "/a/x",
    minus: { bag: "b/run 2.bag", path: "/b/x" },
  });
  // A minus in a filter's text separates nothing.
  assert.equal(bagPathOf("run.bag:/a[:]{name=='x - y'}/z").minus, null);
});

test("the points of a part replace those of the whole there", () => {
  const whole = { times: [0, 1, 2, 3, 4], values: [0, 10, 20, 30, 40] };
  const part = { start: 1, end: 3, times: [1, 1.5, 2.5], values: [11, null, 12] };
  assert.deepEqual(refined(whole, part), { times: [0, 1, 1.5, 2.5, 4], values: [0, 11, NaN, 12, 40] });
  assert.deepEqual(refined(whole, { start: 5, end: 6, times: [], values: [] }), whole);
});

test("a part suffices if it has all points, or enough for the range", () => {
  const part = { start: 10, end: 20, isExact: false };
  assert.equal(suffices(null, 0, 1), false);
  assert.equal(suffices(part, 12, 17), true);
  assert.equal(suffices(part, 12, 13), false);
  assert.equal(suffices(part, 9, 17), false);
  assert.equal(suffices({ ...part, isExact: true }, 12, 12.001), true);
});

test("a part without points of a series does not suffice for finer ranges", () => {
  const series = {
    asked: { id: 1, start: 10, end: 20, keys: [] },
    part: null,
    handlers: { progress: () => {} },
    wanted: new Map(),
    request: () => {},
  };
  BagPlot.prototype.answered.call(series, { id: 1, found: [], errors: {} });
  assert.deepEqual(series.part, { start: 10, end: 20, isExact: false });
});
