// Names as a tree by namespace.
import assert from "node:assert/strict";
import { test } from "node:test";

import { MAX_FLAT, arranged } from "../../../minirospy/web/dashboard/page/js/namespaces.js";

const tree = (names, options = {}) => arranged([...names].sort(), { maxFlat: 0, ...options });
const textOf = (rows) =>
  rows.map(({ kind, label, depth, isOpen, count }) =>
    kind === "name" ? `${" ".repeat(depth)}${label}` : `${" ".repeat(depth)}${isOpen ? "-" : "+"}${label} ${count}`,
  );

test("a small list stays flat", () => {
  const names = Array.from({ length: MAX_FLAT }, (_, index) => `/a/b${index}`);
  assert.ok(arranged(names).every(({ kind, label, name, depth }) => kind === "name" && label === name && !depth));
  assert.equal(arranged([...names, "/a/c"])[0].kind, "folder");
});

test("namespaces are folders, and those with one entry are joined", () => {
  assert.deepEqual(textOf(tree(["/tf", "/a/b/c", "/r/arm/x", "/r/arm/y", "/r/base/odom/z", "/camera/front/image"])), [
    "/a/b/c",
    "/camera/front/image",
    "-/r/ 3",
    " -arm/ 2",
    "  x",
    "  y",
    " base/odom/z",
    "/tf",
  ]);
});

test("a name that is a namespace, too, is both", () => {
  assert.deepEqual(textOf(tree(["/go", "/go/goal", "/go/status"])), ["/go", "-/go/ 2", " goal", " status"]);
  assert.deepEqual(textOf(tree(["/go", "/go/goal"])), ["/go", "-/go/ 1", " goal"]);
});

test("folders that a person has folded stay, a filter opens all, and needed names are shown", () => {
  const names = ["/r/a/x", "/r/a/y", "/r/b/x", "/r/b/y"];
  const toggled = new Map([["/r/a", false]]);
  assert.deepEqual(textOf(tree(names, { toggled })), ["-/r/ 4", " +a/ 2", " -b/ 2", "  x", "  y"]);
  assert.deepEqual(textOf(tree(names, { toggled, isAllOpen: true })).length, 7);
  const many = Array.from({ length: 300 }, (_, index) => `/robot/part_${index % 6}/topic_${index}`);
  const found = tree(many, { needed: new Set(["/robot/part_3/topic_3"]) });
  assert.deepEqual(
    found.slice(0, 3).map(({ label }) => label),
    ["/robot/", "part_0/", "part_1/"],
  );
  assert.equal(found.filter(({ kind }) => kind === "name").length, 50);
});

test("a large tree is unfolded as far as the rows are few", () => {
  const many = Array.from({ length: 300 }, (_, index) => `/robot/part_${index % 6}/topic_${index}`);
  assert.deepEqual(textOf(tree(many)), ["-/robot/ 300", ...[0, 1, 2, 3, 4, 5].map((part) => ` +part_${part}/ 50`)]);
});

test("names that are no names of ROS are kept as they are", () => {
  const names = ["/", "//", "/a//b", "/a//c", "plain", "/<b>"];
  const shown = tree(names).filter(({ kind }) => kind === "name");
  assert.deepEqual(shown.map(({ name }) => name).sort(), [...names].sort());
  assert.deepEqual(tree([]), []);
});
