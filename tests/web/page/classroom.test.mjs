// Table of a class: odd values below /minirospy_class, which any node may set, leave it usable.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

import { classTable, readShared, storeShared, titleOf } from "../../../minirospy/web/dashboard/page/js/classroom.js";

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

const passed = (time, isPassed = true, ever = isPassed) => ({ passed: isPassed, ever, time, number: 1, failures: [] });
const shared = (fields) =>
  readShared(JSON.stringify({ key: "anna", student: "Anna", now: {}, exercises: {}, ...fields }));

test("an old message does not replace later parameters", () => {
  const parameters = new Map([
    ["/minirospy_class/anna/exercises/led/passed", true],
    ["/minirospy_class/anna/exercises/led/ever", true],
    ["/minirospy_class/anna/exercises/led/time", 200],
    ["/minirospy_class/anna/now/leds", "111111"],
    ["/minirospy_class/anna/now/beat", 2],
  ]);
  const old = shared({
    now: { leds: "000000", beat: 90 },
    exercises: { led: passed(100, false), count: passed(100) },
  });
  const seen = new Map([
    ["anna", 20],
    ["/robot1/minirospy_class", 10],
  ]);
  const { students } = classTable(parameters, new Map([["/robot1/minirospy_class", old]]), (each) => seen.get(each));
  assert.equal(students.length, 1);
  const [{ leds, beat, at, results }] = students;
  assert.deepEqual([leds, beat, at], ["111111", 2, 20]);
  assert.deepEqual([results.get("led").passed, results.get("led").ever, results.get("count").ever], [true, true, true]);
});

test("a later message replaces parameters, but an exercise stays passed", () => {
  const parameters = new Map([
    ["/minirospy_class/anna/exercises/led/passed", true],
    ["/minirospy_class/anna/exercises/led/ever", true],
    ["/minirospy_class/anna/exercises/led/time", 100],
    ["/minirospy_class/anna/now/leds", "111111"],
    ["/minirospy_class/anna/now/beat", 90],
  ]);
  const later = shared({ now: { leds: "000001", beat: 1 }, exercises: { led: passed(200, false) } });
  const seenAt = (source) => (source === "anna" ? 10 : 20);
  const { students } = classTable(parameters, new Map([["/robot1/minirospy_class", later]]), seenAt);
  const [{ leds, beat, results }] = students;
  assert.deepEqual([leds, beat], ["000001", 1]);
  assert.deepEqual([results.get("led").passed, results.get("led").ever], [false, true]);
});

test("of states that were seen at once, the one with the larger beat is shown", () => {
  const parameters = new Map([
    ["/minirospy_class/anna/now/leds", "111111"],
    ["/minirospy_class/anna/now/beat", 5],
  ]);
  const levels = [4, 6].map((beat) => {
    const found = shared({ now: { leds: "000000", beat } });
    return classTable(parameters, new Map([["/minirospy_class", found]])).students[0].leds;
  });
  assert.deepEqual(levels, ["111111", "000000"]);
});

test("of a message, only the known parts are kept", () => {
  const exercises = Object.fromEntries(Array.from({ length: 1000 }, (_, i) => [`e${i}`, { passed: true, extra: 1 }]));
  const found = shared({ extra: "x", now: { beat: 1, leds: { deep: 1 }, extra: "x" }, exercises });
  assert.deepEqual(Object.keys(found).sort(), ["exercises", "key", "now", "student"]);
  assert.deepEqual(found.now, { beat: 1 });
  assert.equal(Object.keys(found.exercises).length, 100);
  assert.deepEqual(found.exercises.e0, { passed: true });
});

test("an exercise may have the name of an object's property", () => {
  const found = readShared('{"key": "anna", "exercises": {"__proto__": {"passed": true, "ever": true}}}');
  const { students } = classTable(new Map(), new Map([["/minirospy_class", found]]));
  assert.equal(students[0].results.get("__proto__").ever, true);
});

test("a long message is refused", () => {
  assert.equal(shared({ student: "x".repeat(200_000) }), null);
  const failures = Array(5).fill("\u65e5".repeat(300));
  const exercises = Object.fromEntries(Array.from({ length: 15 }, (_, i) => [`e${i}`, { passed: false, failures }]));
  assert.equal(shared({ exercises }).exercises.e14.failures.length, 5);
});

test("a title has the robot's name if it differs", () => {
  const titles = ["", "pi", "robot1"].map((robot) => titleOf({ name: "pi", robot }));
  assert.deepEqual(titles, ["pi", "pi", "pi (robot1)"]);
});

test("the order in which messages arrive does not matter", () => {
  const [first, second] = ["/robot1/minirospy_class", "/robot2/minirospy_class"].map((topic) => [topic, shared({})]);
  const parameters = new Map([["/minirospy_class/anna/student", "Anna"]]);
  for (const messages of [
    [first, second],
    [second, first],
  ]) {
    const { students } = classTable(parameters, new Map(messages));
    assert.deepEqual(
      students.map(({ key, robot }) => [key, robot]),
      [
        ["anna", "robot1"],
        ["robot2/anna", "robot2"],
      ],
    );
  }
});

test("a full map drops the topics that are no channels any more", () => {
  const map = new Map();
  for (let i = 0; i < 1000; i++) storeShared(map, `/old${i}/minirospy_class`, i, () => true);
  assert.equal(map.size, 200);
  storeShared(map, "/new/minirospy_class", "new", (topic) => topic === "/old7/minirospy_class");
  assert.deepEqual([...map.keys()], ["/old7/minirospy_class", "/new/minirospy_class"]);
  storeShared(map, "/new/minirospy_class", "newer", () => false);
  assert.equal(map.get("/new/minirospy_class"), "newer");
});

/** Return [path, value] of each parameter below a value, as the bridge sends them: an empty dictionary is a value. */
const leaves = (path, value) =>
  value && typeof value === "object" && !Array.isArray(value) && Object.keys(value).length
    ? Object.entries(value).flatMap(([name, each]) => leaves(`${path}/${name}`, each))
    : [[path, value]];

// The same cases are those of `minirospy check --class`, in Python.
const CASES = JSON.parse(readFileSync(new URL("../../course/classes.json", import.meta.url), "utf-8"));
for (const { about, parameters, topics, students, unreadable = [] } of CASES) {
  test(`as minirospy check --class: ${about}`, () => {
    const read = topics.map(([topic, value]) => [
      topic,
      readShared(typeof value === "string" ? value : JSON.stringify(value)),
    ]);
    assert.deepEqual(
      read.filter(([, found]) => !found).map(([topic]) => topic),
      unreadable,
    );
    const table = classTable(
      new Map(leaves("/minirospy_class", parameters)),
      new Map(read.filter(([, found]) => found)),
    );
    const rows = table.students.map(({ name, robot, results }) => [
      name,
      robot,
      Object.fromEntries(
        [...results].map(([each, { passed, ever, time, failures }]) => [each, [passed, ever, time, failures]]),
      ),
    ]);
    assert.deepEqual(rows, students);
  });
}

test("the length of a message is counted in characters, as in Python", () => {
  const message = (count) => JSON.stringify({ key: "eve", student: "😀".repeat(count) });
  assert.equal(readShared(message(149_000))?.key, "eve");
  assert.equal(readShared(message(150_000)), null);
});
