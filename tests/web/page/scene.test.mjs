// The 3D view's frames, colors and descriptions of robots.
import assert from "node:assert/strict";
import { test } from "node:test";

import { fromHex, hexOf, palette, rgbOf } from "../../../minirospy/web/dashboard/page/js/scene/colors.js";
import { stacked } from "../../../minirospy/web/dashboard/page/js/scene/labels.js";
import { readMaterials, readObj } from "../../../minirospy/web/dashboard/page/js/scene/obj.js";
import { Config, readView, writeView } from "../../../minirospy/web/dashboard/page/js/scene/config.js";
import { classOf, getSetting, setSetting, topicKeyOf } from "../../../minirospy/web/dashboard/page/js/scene/classes.js";
import { pointsOfCloud, pointsOfScan } from "../../../minirospy/web/dashboard/page/js/scene/points.js";
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

test("a shape that cannot be read costs that shape, with a line", () => {
  const box = "<geometry><box size='1 1 1'/></geometry>";
  const mesh = (attributes) => `<geometry><mesh filename='package://a/b.stl' ${attributes}/></geometry>`;
  const shapes = [
    ["<geometry><capsule radius='1' length='2'/></geometry>", "the shape <capsule> is not known"],
    ["<geometry><box size='1 2'/></geometry>", '"1 2", where 3 numbers are expected'],
    [mesh("scale='0.001'"), '"0.001", where 3 numbers are expected'],
    [`<origin xyz='0,0,1'/>${box}`, '"0,0,1", where 3 numbers are expected'],
    [`<origin rpy='nan 0 0'/>${box}`, '"nan 0 0", where 3 numbers are expected'],
    ["<geometry><sphere/></geometry>", "<sphere> without radius or length"],
    ["<geometry><cylinder radius='x' length='1'/></geometry>", '"x", where 1 numbers are expected'],
  ];
  for (const [shape, why] of shapes) {
    for (const kind of ["visual", "collision"]) {
      const good = `<visual>${box}</visual>`;
      const { links, notes } = parseUrdf(
        `<robot name="r"><link name="a"><${kind}>${shape}</${kind}>${good}</link></robot>`,
      );
      assert.deepEqual([links.get("a").visuals.length, links.get("a").collisions.length], [1, 0]);
      assert.deepEqual(notes, [`link "a": a shape is left out: ${why}`]);
    }
  }
});

test("materials have colors and textures, by name for all links", () => {
  const visual = (material) => `<visual><geometry><box size='1 1 1'/></geometry>${material}</visual>`;
  const { links, notes } = parseUrdf(
    `<robot name="r"><material name="m"><texture filename="package://a/b.png"/></material><link name="a">
    ${visual('<material name="m"/>')}${visual('<material name="n"><color rgba="1 0 0 1"/></material>')}
    ${visual('<material name="n"/>')}${visual('<material name="bad"><color rgba="1 0 0"/></material>')}${visual("")}
    </link></robot>`,
  );
  assert.deepEqual(
    links.get("a").visuals.map(({ color, texture }) => [color, texture]),
    [
      [null, "package://a/b.png"],
      [[1, 0, 0, 1], ""],
      [[1, 0, 0, 1], ""],
      [null, ""],
      [null, ""],
    ],
  );
  assert.deepEqual(notes, []);
});

test("a range that equals the largest one is left out, as in RViz", () => {
  const scan = { angle_min: 0, angle_increment: 1, range_min: 1, range_max: 5, intensities: [] };
  assert.equal(pointsOfScan({ ...scan, ranges: [0.5, 1, 4.999, 5, 6, Infinity, NaN] }).count, 2);
});

test("files of Wavefront's format have triangles by material, with normals where each corner has one", () => {
  const text = `mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1
usemtl red one\nf 1//1 2//1 3//1 4//1\nusemtl blue\nf -4 -3 -2\nf 1/1 2/2 \\\n3/3`;
  const { parts, libraries } = readObj(text);
  assert.deepEqual(libraries, ["a.mtl"]);
  assert.deepEqual(
    parts.map(({ material, positions, normals }) => [material, positions.length, normals?.length ?? null]),
    [
      ["red one", 18, 18],
      ["blue", 18, null],
    ],
  );
  assert.throws(() => readObj("v 0 0 0\nf 1 2 3"));
  const found = readMaterials("newmtl red one\nKd 1 0.5 0\nd 0.25\nnewmtl b\nTr 0.25\nnewmtl c\nd -halo 0.5");
  assert.deepEqual(found.get("red one"), { rgb: [255, 127.5, 0] });
  assert.deepEqual(found.get("b"), { rgb: [153, 153, 153] });
  assert.deepEqual(found.get("c"), { rgb: [153, 153, 153] });
  assert.deepEqual(readMaterials("newmtl a\nKe 0.5 0 1").get("a").emission, [0.5, 0, 1]);
});

test("an empty cloud is empty, also without fields", () => {
  const cloud = {
    width: 0,
    height: 1,
    point_step: 0,
    row_step: 0,
    fields: [],
    data: new Uint8Array(),
    is_bigendian: 0,
  };
  assert.equal(pointsOfCloud(cloud, ["rgb"]).count, 0);
  assert.throws(() => pointsOfCloud({ ...cloud, width: 1 }));
});

test("a file of RViz 2 is read, and keeps its names", () => {
  const topic = (name) => ({
    Depth: 5,
    "Durability Policy": "Volatile",
    "Reliability Policy": "Best Effort",
    Value: name,
  });
  const raw = {
    "Visualization Manager": {
      Displays: [
        { Class: "rviz_default_plugins/LaserScan", Name: "scan", Enabled: true, Topic: topic("/scan") },
        { Class: "rviz_default_plugins/MarkerArray", Name: "m", Enabled: true, Topic: topic("/markers") },
        { Class: "rviz_default_plugins/Image", Name: "i", Enabled: true, Topic: topic("/image") },
        {
          Class: "rviz_default_plugins/InteractiveMarkers",
          Name: "im",
          Enabled: true,
          "Interactive Markers Namespace": "/marker",
        },
        { Class: "rviz_common/Group", Name: "g", Displays: [{ Class: "rviz_default_plugins/Grid", Name: "grid" }] },
        { Class: "nav2_rviz_plugins/ParticleCloud", Name: "p", Topic: topic("/p") },
      ],
      Tools: [{ Class: "rviz_default_plugins/SetGoal", Topic: topic("/goal_pose") }],
      Views: { Current: { Class: "rviz_default_plugins/TopDownOrtho", Scale: 40, X: 1, Y: 2 } },
    },
  };
  const config = new Config(structuredClone(raw));
  const [scan, markers, image, interactive] = config.displays().map(({ settings }) => settings);
  const topicOf = (settings) => getSetting(settings, topicKeyOf(classOf(settings)));
  assert.deepEqual([scan, markers, image, interactive].map(topicOf), ["/scan", "/markers", "/image", "/marker/update"]);
  assert.equal("Marker Topic" in markers, false);
  setSetting(markers, "Marker Topic", "/other");
  setSetting(interactive, "Update Topic", "/box/update");
  assert.equal(markers.Topic.Value, "/other");
  assert.equal(interactive["Interactive Markers Namespace"], "/box");
  assert.deepEqual(config.unknown(), ["p (nav2_rviz_plugins/ParticleCloud)"]);
  assert.equal(config.toolTopic("SetGoal", "/x"), "/goal_pose");
  assert.deepEqual([readView(config.view).kind, readView(config.view).scale], ["top", 40]);
  writeView(config.view, { ...readView(config.view), kind: "orbit" });
  assert.equal(config.view.Class, "rviz_default_plugins/Orbit");
});

test("of names at one place three are stacked, and the others are hidden", () => {
  const taken = [];
  const tops = Array.from({ length: 6 }, () => stacked(taken, 100, 50, 40, 15));
  assert.deepEqual(tops, [50, 65, 80, null, null, null]);
  assert.equal(stacked(taken, 150, 50, 40, 15), 50);
  // 65.1 - 50.1 is a little less than 15.
  const fractions = [];
  assert.ok(stacked(fractions, 0, 50.1, 40, 15) < stacked(fractions, 0, 50.1, 40, 15));
  assert.ok(stacked(fractions, 0, 65.1, 40, 15) > 65);
});
