// What the palette finds.
import assert from "node:assert/strict";
import { test } from "node:test";

import { entriesOf, matching } from "../../../minirospy/web/dashboard/page/js/palette.js";

const LINK = {
  channels: new Map([
    ["/turtle1/pose", {}],
    ["/plot/data", {}],
  ]),
  services: new Map([["/reset", {}]]),
  graph: {
    published: new Map([["/turtle1/pose", ["/turtlesim"]]]),
    subscribed: new Map([["/turtle1/cmd_vel", ["/turtlesim", "/recorder"]]]),
    services: new Map(),
  },
};
const entries = () => entriesOf({ topics: ["Topics"], plot: ["Plot"] }, ["workshop"], LINK);
const labels = (text) => matching(entries(), text).map(({ label }) => label);

test("everything is listed, views first", () => {
  assert.deepEqual(labels(""), [
    "Topics",
    "Plot",
    "workshop",
    "/plot/data",
    "/turtle1/pose",
    "/reset",
    "/recorder",
    "/turtlesim",
  ]);
});

test("a name that begins with the text is first, then a part that does", () => {
  assert.deepEqual(labels("plot"), ["Plot", "/plot/data"]);
  assert.deepEqual(labels("pose"), ["/turtle1/pose"]);
});

test("all words must be there; a kind is a word", () => {
  assert.deepEqual(labels("turtle node"), ["/turtlesim"]);
  assert.deepEqual(labels("turtle nothing"), []);
});

test("an entry opens the view that shows it", () => {
  const fragments = Object.fromEntries(entries().map(({ label, fragment }) => [label, fragment]));
  assert.equal(fragments["Plot"], "#/plot");
  assert.equal(fragments["workshop"], "#/layout?preset=workshop");
  assert.equal(fragments["/turtle1/pose"], "#/topics?open=%2Fturtle1%2Fpose");
  assert.equal(fragments["/recorder"], "#/nodes?node=%2Frecorder");
});
