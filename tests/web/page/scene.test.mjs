// The 3D view's frames, colors and descriptions of robots.
import assert from "node:assert/strict";
import { test } from "node:test";

import { fromHex, hexOf, palette, rgbOf } from "../../../minirospy/web/dashboard/page/js/scene/colors.js";
import {
  apply,
  compose,
  FrameError,
  Frames,
  fromRpy,
  interpolate,
  invert,
  normalized,
  yawOf,
} from "../../../minirospy/web/dashboard/page/js/scene/transforms.js";
import { parseUrdf, UrdfError } from "../../../minirospy/web/dashboard/page/js/scene/urdf.js";
import { parseXml, XmlError } from "../../../minirospy/web/dashboard/page/js/scene/xml.js";

const near = (found, wanted) => {
  assert.equal(found.length, wanted.length);
  found.forEach((value, index) => assert.ok(Math.abs(value - wanted[index]) < 1e-9, `${found} is not ${wanted}`));
};

test("a transform and its inverse undo each other", () => {
  const transform = { p: [1, 2, 3], q: fromRpy([0.1, -0.4, 2]) };
  near(apply(invert(transform), apply(transform, [4, 5, 6])), [4, 5, 6]);
  const none = compose(transform, invert(transform));
  near(none.p, [0, 0, 0]);
  near(none.q.map(Math.abs), [0, 0, 0, 1]);
});

test("half of the way is half of the turn, by the shorter arc", () => {
  const one = { p: [0, 0, 0], q: fromRpy([0, 0, 3]) };
  const other = { p: [2, 0, 0], q: fromRpy([0, 0, -3]) };
  const middle = interpolate(one, other, 0.5);
  near(middle.p, [1, 0, 0]);
  assert.ok(Math.abs(Math.abs(yawOf(middle.q)) - Math.PI) < 1e-9);
  near(normalized([0, 0, 0, 0]), [0, 0, 0, 1]);
});

test("frames are looked up in time, as tf2 does", () => {
  const frames = new Frames();
  const at = (x) => ({ translation: { x, y: 0, z: 0 }, rotation: { x: 0, y: 0, z: 0, w: 1 } });
  frames.insert("map", "base", 10, at(0));
  frames.insert("map", "base", 12, at(2));
  frames.insert("base", "arm", 0, at(5), true);
  near(frames.lookup("map", "arm", 11).p, [6, 0, 0]);
  near(frames.lookup("arm", "map", 11).p, [-6, 0, 0]);
  const kindOf = (target, source, seconds) => {
    try {
      frames.lookup(target, source, seconds);
    } catch (error) {
      assert.ok(error instanceof FrameError);
      return error.kind;
    }
    return "found";
  };
  assert.equal(kindOf("map", "nowhere", 11), "unknown");
  assert.equal(kindOf("map", "base", 20), "future");
  assert.equal(kindOf("map", "base", 1), "past");
  frames.insert("other", "island", 11, at(0));
  assert.equal(kindOf("map", "island", 11), "unconnected");
});

test("colors are read as RViz writes them", () => {
  near(rgbOf("25; 255; 0"), [25, 255, 0]);
  assert.equal(hexOf("25; 255; 0"), "#19ff00");
  assert.equal(fromHex("#19ff00"), "25; 255; 0");
  assert.equal(palette("map").length, 1024);
});

test("XML is read with the line of its faults", () => {
  const { name, attributes, children } = parseXml('<?xml version="1.0"?>\n<a x="1 &lt; 2"><!-- c --><b/>t</a>');
  assert.deepEqual([name, attributes.x, children.length], ["a", "1 < 2", 1]);
  assert.throws(
    () => parseXml("<a>\n<b></a>"),
    (error) => error instanceof XmlError && /line 2/.test(error.message),
  );
  assert.throws(() => parseXml("<a>".repeat(600)), XmlError);
});

test("xml is read as leniently as TinyXML reads it, with one note for each kind of fault", () => {
  const declared = '<?xml version="1.0"?>\n';
  for (const [text, value, note] of [
    [`${declared}<!-- a -- b --->\n<r n="x"/>`, "x", "line 2: '--' is not allowed inside a comment"],
    [`\n${declared}<r n="x"/>`, "x", "line 2: the XML declaration has to be at the start of the text"],
    ['<r n="a & b"/>', "a  b", "line 1: '&' is not allowed alone"],
    ['<r n="a&nbsp;b"/>', "anbsp;b", "line 1: '&' is not allowed alone"],
    ['<r n="x">\na & b & c</r>', "x", "line 1: '&' is not allowed alone"],
    ['<r n="x"/>\n<!-- -->\n\nmore <', "x", "line 4: everything after the end of <r> is ignored"],
    ['<r n="x"/><r n="y"/>', "x", "line 1: everything after the end of <r> is ignored"],
    ['<?xml?><r n="x"/>', "x", "line 1: the XML declaration has to begin with"],
    ["<r n=x/>", "x", "line 1: the value of an attribute is not in quotes"],
    ['<r n="a<b"/>', "a<b", "line 1: '<' is not allowed in an attribute"],
    ['<r n="x"m="y"/>', "x", "line 1: a space is missing between two attributes"],
  ]) {
    const { attributes, notes } = parseXml(text);
    assert.equal(attributes.n, value, text);
    assert.deepEqual([notes.length, notes[0]?.startsWith(note)], [1, true], `${text}: ${notes}`);
  }
  for (const text of ['<?xml version="1"?><r/>', "\ufeff<r/>", `${declared}<r n="&amp;"><![CDATA[&]]></r>\n<!-- -->`])
    assert.deepEqual(parseXml(text).notes, []);
  for (const text of ["", "hello <r/>", "<r></s>", "<r n/>", "<r><!-- </r>", "< r/>"])
    assert.throws(() => parseXml(text), XmlError);
});

test("a robot needs one root link", () => {
  const joint = '<joint name="j" type="fixed"><parent link="a"/><child link="b"/></joint>';
  assert.equal(parseUrdf(`<robot name="r"><link name="a"/><link name="b"/>${joint}</robot>`).root, "a");
  assert.throws(() => parseUrdf('<robot name="r"><link name="a"/><link name="b"/></robot>'), UrdfError);
});
