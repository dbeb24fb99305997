// Log lines, clocks and sizes, as the page shows them.
import assert from "node:assert/strict";
import { test } from "node:test";

import { csv, filterOf, lineOf, linesOf, plainText } from "../../../minirospy/web/dashboard/page/js/logs.js";
import { codeParts } from "../../../minirospy/web/dashboard/page/js/texts.js";
import { Axis, clockText, heights, roundStep, sizeText } from "../../../minirospy/web/dashboard/page/js/timeline.js";

test("code is what two backticks enclose, and text stays text", () => {
  assert.deepEqual(codeParts("start `roscore`, or set `<b>`"), [
    ["start ", false],
    ["roscore", true],
    [", or set ", false],
    ["<b>", true],
  ]);
  assert.deepEqual(codeParts("one ` alone"), [["one ` alone", false]]);
  assert.deepEqual(codeParts(""), []);
});

test("lines of a log file are read in three forms", () => {
  const text = [
    "12.5 ERROR /talker [a.py:7(main)] [topics: /rosout] bad",
    "more",
    "[rospy.x][WARNING] 2020-01-02 03:04:05,678: careful",
    "\x1b[31m[ERROR] [99.5]: red\x1b[0m",
  ].join("\n");
  const lines = linesOf(text, "file");
  assert.deepEqual(
    lines.map(({ level, node, text: each }) => [level, node, each]),
    [
      [8, "/talker", "bad\nmore"],
      [4, "rospy.x", "careful"],
      [8, "file", "red"],
    ],
  );
  assert.deepEqual([lines[0].stamp, lines[0].file, lines[0].line, lines[0].function], [12.5, "a.py", 7, "main"]);
});

test("a line of rosgraph_msgs/Log has the time of its header, else that of its arrival", () => {
  const message = {
    header: { stamp: { secs: 0, nsecs: 0 } },
    level: 2,
    name: "/n",
    msg: "hi",
    file: "",
    line: 0,
    function: "",
  };
  assert.equal(lineOf({ message, seconds: 5 }).stamp, 5);
  assert.equal(plainText(lineOf({ message, seconds: 5 })), "[INFO] [5.000000] [/n]: hi");
});

test("lines are filtered by level, node, text and pattern", () => {
  const line = { level: 8, node: "/a", text: "Motor is hot" };
  const passes = (change) =>
    filterOf({ levels: new Set([8]), node: "", text: "", isRegex: false, isExcluded: false, ...change })(line);
  assert.ok(passes({}) && passes({ text: "MOTOR" }) && passes({ text: "is.*t$", isRegex: true }));
  assert.ok(!passes({ levels: new Set([2]) }) && !passes({ node: "/b" }) && !passes({ text: "hot", isExcluded: true }));
  assert.throws(
    () => filterOf({ levels: new Set(), node: "", text: "(", isRegex: true, isExcluded: false }),
    SyntaxError,
  );
});

test("quotes in a field of CSV are doubled", () => {
  const line = { stamp: 1, level: 2, node: "/n", text: 'a "b"\nc', file: "f", line: 3, function: "g" };
  assert.match(csv([line]), /"a ""b""\nc"/);
});

test("zooming keeps the time under the pointer, and stays inside", () => {
  const axis = new Axis(100, 1000);
  axis.zoom(0.5, 250);
  assert.deepEqual([axis.start, axis.end, axis.time(250)], [12.5, 62.5, 25]);
  axis.pan(-1e6);
  assert.deepEqual([axis.start, axis.end], [0, 50]);
  assert.equal(axis.follow(80), true);
  assert.ok(axis.start <= 80 && 80 <= axis.end);
  axis.zoom(1e9, 0);
  assert.deepEqual([axis.start, axis.end], [0, 100]);
});

test("steps between labels are round", () => {
  assert.deepEqual(
    [0.003, 0.7, 4, 25, 31, 100, 4000, 90_000].map(roundStep),
    [0.005, 1, 5, 30, 60, 120, 7200, 172_800],
  );
  const { step, times } = new Axis(10, 900).ticks(90);
  assert.deepEqual([step, times.length], [1, 11]);
});

test("times and sizes are short", () => {
  assert.deepEqual([clockText(3723.456), clockText(62.04, 0.1), clockText(5, 1)], ["1:02:03.456", "1:02.0", "0:05"]);
  assert.deepEqual([999, 1500, 2_500_000, 3e9].map(sizeText), ["999 B", "1.5 kB", "2.5 MB", "3.0 GB"]);
  assert.equal(heights([0, 1, 1000])[0], 0);
  assert.ok(heights([0, 1, 1000])[1] >= 0.55);
});
