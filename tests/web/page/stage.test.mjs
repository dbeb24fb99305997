// When the 3D view draws, and what it keeps: without WebGL, on a stage whose clock and canvas are set by the test.

import assert from "node:assert/strict";
import { test } from "node:test";

import { RobotModel } from "../../../minirospy/web/dashboard/page/js/scene/displays/robot.js";
import { Stage } from "../../../minirospy/web/dashboard/page/js/scene/stage.js";

/** Return a stage that has drawn a picture, which took this long, just now. */
function stageAfter(milliseconds, values = {}) {
  const stage = Object.create(Stage.prototype);
  const renderer = { setPixelRatio() {}, setSize() {} };
  const frame = { clientWidth: 300, clientHeight: 200 };
  const gl = { clientWaitSync: () => 0, deleteSync() {} };
  return Object.assign(stage, {
    canvas: { dataset: {} },
    renderer,
    frame,
    gl,
    isStale: false,
    isCleared: false,
    loads: 0,
    released: [],
    fence: null,
    started: performance.now() - milliseconds,
    milliseconds,
    ratio: 0,
    coarser: 0,
    mostPoints: 1000,
    ...values,
  });
}

test("slow pictures of a part of the scene are postponed while meshes load, and others are not", () => {
  const started = performance.now() + 100_000; // however slow the test is
  assert.equal(stageAfter(500, { loads: 1, started }).isEarly(), true);
  assert.equal(stageAfter(500, { loads: 0 }).isEarly(), false);
  assert.equal(stageAfter(0, { loads: 1 }).isEarly(), false);
});

test("a picture is not postponed for longer than a second after the last one", () => {
  assert.equal(stageAfter(2000, { loads: 1, started: performance.now() - 3100 }).isEarly(), false);
});

test("time in a hidden tab does not count as time of a picture", () => {
  const stage = stageAfter(0, { loads: 1, fence: {}, started: performance.now() - 3_600_000 });
  assert.equal(stage.isFinished(), true);
  assert.ok(stage.milliseconds <= 2000);
  assert.equal(stage.isEarly(), false);
});

test("a resized canvas, which is empty, is drawn at once", (context) => {
  globalThis.devicePixelRatio = 1;
  context.after(() => delete globalThis.devicePixelRatio);
  const stage = stageAfter(500, { loads: 1 });
  stage.resize();
  assert.equal(stage.isStale, true);
  assert.equal(stage.isEarly(), false);
});

test("a stage that has something to draw is not settled", () => {
  const stage = stageAfter(10);
  stage.showSettled();
  assert.equal(stage.canvas.dataset.settled, "true");
  stage.invalidate();
  assert.equal(stage.canvas.dataset.settled, "false");
});

test("materials live until the next picture, but not in a hidden tab", (context) => {
  globalThis.document = { hidden: false };
  context.after(() => delete globalThis.document);
  const disposed = [];
  const stage = stageAfter(10);
  stage.release({ dispose: () => disposed.push("first") });
  assert.deepEqual(disposed, []);
  globalThis.document.hidden = true;
  stage.release({ dispose: () => disposed.push("second") });
  assert.deepEqual(disposed, ["first", "second"]);
});

test("what a replaced description loads neither fails nor delays the new one", async () => {
  const statuses = new Map();
  const model = Object.assign(Object.create(RobotModel.prototype), {
    status: statuses,
    context: { stage: { load: (work) => work() }, statusChanged() {} },
    loading: { count: 0, failed: [] },
  });
  let fail;
  const late = model.load(() => new Promise((_, reject) => (fail = () => reject(new Error("late")))));
  model.loading = { count: 0, failed: [] };
  fail();
  await late;
  assert.deepEqual([...statuses], []);
  assert.equal(model.loading.count, 0);

  await model.load(() => Promise.reject(new Error("no such file")));
  assert.deepEqual(statuses.get("Meshes"), [2, "no such file"]);
});
