// The state of topics and nodes in reports, and the doctor's texts in German.
import assert from "node:assert/strict";
import { test } from "node:test";

import { PARTS, TEXTS, translated } from "../../../minirospy/web/dashboard/page/js/findings.js";
import { GERMAN } from "../../../minirospy/web/dashboard/page/js/german.js";
import {
  TopicHealth,
  linesToShow,
  nodesOf,
  signatureOf,
  verdictOf,
  viewOf,
} from "../../../minirospy/web/dashboard/page/js/health.js";
import { chooseLanguage } from "../../../minirospy/web/dashboard/page/js/texts.js";

const node = (name, publishes = [], subscribes = [], more = {}) => ({
  name,
  publishes,
  subscribes,
  trouble: "",
  ...more,
});
const SCAN = ["/scan", "sensor_msgs/LaserScan"];
const WORDS = ["/words", "std_msgs/String"];
const GRAPH = [node("/laser", [SCAN, WORDS]), node("/map", [], [SCAN, WORDS])];

/** Return a report in which these topics have a rate: topic -> Hz. */
const report = (nodes, rates = {}, mismatches = {}) => ({
  nodes,
  traffic: Object.entries(rates).map(([topic, hz]) => ["/laser", topic, "/map", hz, hz * 10]),
  mismatches,
});
const statesOf = (topics) => Object.fromEntries(topics.map(({ topic, state }) => [topic, state]));

test("a stream that sends nothing is silent after some reports, another topic is not", () => {
  const health = new TopicHealth();
  const none = report(GRAPH, { "/scan": 0, "/words": 0 });
  assert.deepEqual(statesOf(health.received(none)), { "/scan": "quiet", "/words": "quiet" });
  health.received(none);
  assert.deepEqual(statesOf(health.received(none)), { "/scan": "silent", "/words": "quiet" });
  const found = health.received(report(GRAPH, { "/scan": 9, "/words": 0 }));
  assert.deepEqual(statesOf(found), { "/scan": "flows", "/words": "quiet" });
  assert.deepEqual([found[0].hz, found[0].bytes], [9, 90]);
});

test("a topic that had a rate and falls silent is missed, one that no node receives is not", () => {
  const health = new TopicHealth();
  health.received(report(GRAPH, { "/words": 5 }));
  for (let count = 0; count < 3; count++) health.received(report(GRAPH, { "/words": 0 }));
  assert.deepEqual(statesOf(health.received(report(GRAPH, { "/words": 0 }))), {
    "/words": "silent",
    "/scan": "quiet",
  });
  assert.equal(statesOf(health.received(report(GRAPH, {})))["/words"], "quiet");
});

test("topics without a publisher and with two types are named, tools and goals are not", () => {
  const graph = [
    node(
      "/robot",
      [["/go/status", "x/S"]],
      [
        ["/cmd", "x/T"],
        ["/go/goal", "x/G"],
      ],
    ),
    node("/minirospy_dashboard_1", [["/own", "x/T"]], [["/other", "x/T"]]),
  ];
  const found = new TopicHealth().received(report(graph, {}, { "/go/status": { "x/S": [], "x/R": [] } }));
  assert.deepEqual(statesOf(found), { "/go/status": "mismatch", "/cmd": "unpublished", "/go/goal": "quiet" });
  assert.deepEqual(
    nodesOf({ nodes: graph }).map(({ name }) => name),
    ["/robot"],
  );
});

test("the rate of two publishers is their sum, that of two subscribers is not", () => {
  const graph = [node("/a", [WORDS]), node("/b", [WORDS]), node("/c", [], [WORDS]), node("/d", [], [WORDS])];
  const traffic = [
    ["/a", "/words", "/c", 2, 20],
    ["/a", "/words", "/d", 2, 20],
    ["/b", "/words", "/c", 3, 30],
  ];
  const [found] = new TopicHealth().received({ nodes: graph, traffic, mismatches: {} });
  assert.deepEqual([found.hz, found.bytes], [5, 50]);
});

test("nodes that do not answer are first, then those that use the processor most", () => {
  const nodes = [
    node("/idle", [], [], { cpu: 0 }),
    node("/busy", [], [], { cpu: 90 }),
    node("/dead", [], [], { trouble: "x" }),
  ];
  assert.deepEqual(
    nodesOf({ nodes }).map(({ name }) => name),
    ["/dead", "/busy", "/idle"],
  );
  const before = signatureOf(nodes, []);
  assert.equal(signatureOf([...nodes].reverse(), []), before);
  assert.notEqual(signatureOf(nodes.slice(1), []), before);
});

test("the verdict counts problems, warnings and silent topics", () => {
  const silent = { topic: "/scan", state: "silent" };
  assert.equal(verdictOf([{ status: "ok" }], []).level, "good");
  assert.deepEqual(verdictOf([{ status: "warning" }], [silent]), { level: "warning", problems: 0, warnings: 2 });
  assert.equal(verdictOf([{ status: "problem" }], []).level, "problem");
});

test("warnings stay in the log though many lines came since", () => {
  const lines = Array.from({ length: 50 }, (_, index) => ({ level: index === 3 ? 8 : 2, index }));
  assert.deepEqual(
    linesToShow(lines, 3, 2).map(({ index }) => index),
    [3, 47, 48, 49],
  );
  assert.deepEqual(linesToShow([], 3, 2), []);
});

test("a finding leads to the view that shows more", () => {
  assert.deepEqual(viewOf({ check: "nodes", text: "/a, /b: nothing listens" }), ["nodes", { node: "/a" }]);
  assert.deepEqual(viewOf({ check: "frames", text: "" }), ["tf", {}]);
  assert.equal(viewOf({ check: "python", text: "" }), null);
});

test("all texts of the doctor in the list are German, what is in them stays", () => {
  assert.deepEqual(
    [...TEXTS, ...PARTS].filter((text) => !Object.hasOwn(GERMAN, text)),
    [],
  );
  chooseLanguage("de");
  assert.equal(translated("nobody publishes /a (b.c), /d"), "niemand sendet /a (b.c), /d");
  assert.equal(translated("a text that is new"), "a text that is new");
  assert.equal(
    translated("nobody publishes /led_comand (/node; /led_command is published), /b (/c)"),
    "niemand sendet /led_comand (/node; /led_command wird gesendet), /b (/c)",
  );
  assert.equal(
    translated("/a, /b and 3 more: another program answers at their port on 'pi': timed out after 1.5 s"),
    "/a, /b und 3 weitere: an ihrem Port auf 'pi' antwortet ein anderes Programm: nach 1.5 s keine Antwort",
  );
  assert.equal(
    translated(
      "2 trees that are not connected, with the roots [map], [odom] ([odom] is nearly [odm]: was one of them meant?)",
    ),
    "2 Bäume ohne Verbindung, mit den Wurzeln [map], [odom] ([odom] ist fast [odm]: war eines davon gemeint?)",
  );
  // The master's machine is named in the nominative.
  assert.equal(
    translated("that of the master's machine (pi) is 3.0 s ahead of this one"),
    "der Rechner des Masters (pi): die Uhr geht gegenüber dieser 3.0 s vor",
  );
  assert.equal(translated("that of pi is 3.0 s behind this one"), "pi: die Uhr geht gegenüber dieser 3.0 s nach");
  assert.equal(
    translated("the master's machine (pi) does not reach this one at 10.0.0.7:40001"),
    "der Rechner des Masters (pi) erreicht diesen Rechner an 10.0.0.7:40001 nicht",
  );
  assert.equal(
    translated("pi does not reach this one at 10.0.0.7:40001: connection refused"),
    "pi erreicht diesen Rechner an 10.0.0.7:40001 nicht: Verbindung abgelehnt",
  );
  const long = `nobody publishes ${"/a is in /b and in /c; ".repeat(1000)}`;
  assert.equal(translated(long), long);
  chooseLanguage("en");
  assert.equal(translated("nobody publishes /a"), "nobody publishes /a");
});

test("a node is masculine in German, as in the course", () => {
  const feminine = /\b(die|diese|jene|einer?|keine|[dms]eine|ihre) (\w+e )?Node\b/i;
  assert.deepEqual(
    Object.values(GERMAN).filter((text) => feminine.test(text)),
    [],
  );
});
