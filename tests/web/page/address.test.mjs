// The addresses of views, and the text of layouts.
import assert from "node:assert/strict";
import { test } from "node:test";

import { addressOf, fragmentOf, wordsOf } from "../../../minirospy/web/dashboard/page/js/address.js";
import { Layout, MAX_PANES, sideAt } from "../../../minirospy/web/dashboard/page/js/layout.js";

test("a fragment is read as it was written", () => {
  const words = { path: ["/a/b", "/c?d=1&e"], frozen: true, empty: "", off: false, none: null, zero: 0 };
  const { view, words: read } = addressOf(fragmentOf("plot", words));
  assert.equal(view, "plot");
  assert.deepEqual(read.getAll("path"), ["/a/b", "/c?d=1&e"]);
  assert.deepEqual([...read.keys()], ["path", "path", "frozen", "zero"]);
  assert.equal(read.get("frozen"), "1");
});

test("a fragment without settings has no question mark", () => {
  assert.equal(fragmentOf("topics", {}), "#/topics");
  assert.equal(fragmentOf("topics", "a=1&b="), "#/topics?a=1");
  assert.equal(wordsOf(new URLSearchParams("a=")).toString(), "a=");
});

test("the text of a layout is that which was parsed", () => {
  for (const text of ["", "graph", "row(75:board,25:column(plot?path=%2Fa,graph))", "column(a,b,c)"])
    assert.equal(Layout.parse(text).toString(), text);
});

test("parts that are alone or of the same direction are joined", () => {
  assert.equal(Layout.parse("row(column(graph))").toString(), "graph");
  assert.equal(Layout.parse("row(a,row(b,c))").toString(), "row(50:a,25:b,25:c)");
});

test("a bad layout is refused with its place", () => {
  assert.throws(() => Layout.parse("row(a"), /a "\)" is missing/);
  assert.throws(() => Layout.parse("box(a)"), /neither row\( nor column\(/);
  assert.throws(() => Layout.parse("a)b"), /"\)b" is not expected/);
  assert.throws(
    () =>
      Layout.parse(
        `row(${Array(MAX_PANES + 1)
          .fill("a")
          .join(",")})`,
      ),
    /24 views at most/,
  );
  assert.throws(() => Layout.parse("a".repeat(20_001)), /too long/);
});

test("a view is added at a side, moved and removed", () => {
  const layout = Layout.parse("a");
  const [first] = layout.panes();
  layout.add("b", "", "bottom", first);
  assert.equal(layout.toString(), "column(a,b)");
  layout.move(layout.panes()[1], "left", first);
  assert.equal(layout.toString(), "row(b,a)");
  layout.remove(first);
  assert.equal(layout.toString(), "b");
});

test("the middle of a box is no side", () => {
  assert.equal(sideAt(0.5, 0.5), "center");
  assert.equal(sideAt(0.1, 0.5), "left");
  assert.equal(sideAt(0.5, 0.9), "bottom");
});
