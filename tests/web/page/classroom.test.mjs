// Table of a class: odd values below /minirospy_class, which any node may set, leave it usable.

import assert from "node:assert/strict";
import { test } from "node:test";

import { classTable } from "../../../minirospy/web/dashboard/page/js/classroom.js";

const ODD = [{ toString: 1, valueOf: 1 }, null, 5, ["/deep"]];
const table = (values) =>
  classTable(new Map(Object.entries(values).map(([path, value]) => [`/minirospy_class/${path}`, value])));

test("only texts are failures and nodes", () => {
  const { students } = table({
    "eve/student": "Eve",
    "eve/now/nodes": [...ODD, "/camera"],
    "eve/now/leds": ODD,
    "eve/now/buttons": ODD[0],
    "eve/exercises/led/failures": [...ODD, "The LED stays dark"],
  });
  assert.deepEqual(students[0].nodes, ["/camera"]);
  assert.deepEqual([students[0].leds, students[0].buttons], ["", ""]);
  assert.deepEqual(students[0].results.get("led").failures, ["The LED stays dark"]);
});

test("levels may be a number", () => {
  const { students } = table({ "eve/now/leds": 100000, "eve/now/buttons": "01" });
  assert.deepEqual([students[0].leds, students[0].buttons], ["100000", "01"]);
});

test("long texts and lists are cut", () => {
  const long = "x".repeat(5000);
  const { students } = table({
    "eve/student": long,
    "eve/now/nodes": Array(1000).fill(long),
    "eve/exercises/led/failures": Array(1000).fill(long),
  });
  const [{ name, nodes, results }] = students;
  assert.deepEqual([name.length, nodes.length, nodes[0].length], [60, 10, 300]);
  assert.deepEqual([results.get("led").failures.length, results.get("led").failures[0].length], [5, 300]);
});

test("exercises and students have a limit", () => {
  const values = {};
  for (let i = 0; i < 50000; i++) values[`s${i}/exercises/e${i}/passed`] = true;
  for (let i = 0; i < 50000; i++) values[`s0/exercises/f${i}/passed`] = true;
  const { exercises, students } = table(values);
  assert.equal(exercises.length, 100);
  assert.equal(students.length, 200);
  assert.equal(students[0].results.size, 1);
});

test("exercises that are no dictionary are left out", () => {
  assert.deepEqual(table({ "eve/exercises": 5, "eve/now": 5 }).exercises, []);
});
