// The window of a simulation: fields, poses, the SDF of shapes, its state.
import assert from "node:assert/strict";
import { test } from "node:test";

import { fromRpy } from "../../../minirospy/web/dashboard/page/js/scene/transforms.js";
import {
  clockText,
  durationOf,
  freeName,
  heightOf,
  isThere,
  jointsOf,
  librarySdf,
  poseOf,
  pushOf,
  rateOf,
  readName,
  readNumber,
  readState,
  SHAPES,
  shapeSdf,
  splitLink,
  stateOf,
  threeDecimals,
  toRpy,
  viewOf,
} from "../../../minirospy/web/dashboard/page/js/simulation.js";

test("numbers of fields are read, and anything else is named", () => {
  assert.equal(readNumber(" 1.5 ", "x"), 1.5);
  assert.equal(readNumber("1,5", "x"), 1.5);
  assert.equal(readNumber("-2e-3", "x"), -0.002);
  for (const text of ["", " ", "NaN", "Infinity", "-Infinity", "1e999", "abc", "1 2", "1e7", "-1e7"])
    assert.throws(() => readNumber(text, "yaw"), /yaw/, text);
  assert.throws(() => readNumber("0", "radius", { least: 0, isAbove: true }), /radius: 0 is not above 0/);
  assert.throws(() => readNumber("0", "Steps", { least: 1, most: 10 }), /Steps: 0 is not from 1 to 10/);
});

test("names are short, plain and new", () => {
  assert.equal(readName(" box_1 "), "box_1");
  assert.equal(readName("Kiste-ä.2"), "Kiste-ä.2");
  for (const name of ["", "  ", "a b", "a::b", "<b>", 'a"', "a/b", "x".repeat(101)])
    assert.throws(() => readName(name), Error, name);
  assert.throws(() => readName("box", ["box"]), /There is a model "box" already/);
  assert.equal(freeName("box", ["box_0", "box_2"]), "box_1");
  assert.throws(() => librarySdf("../../etc/passwd"));
  assert.throws(() => librarySdf("a</uri>"));
  assert.match(librarySdf("table"), /<uri>model:\/\/table<\/uri>/);
});

test("poses go to quaternions and back", () => {
  for (const rpy of [
    [0, 0, 0],
    [0.3, -0.4, 2.5],
    [-3, 1.2, -0.1],
  ])
    toRpy(fromRpy(rpy)).forEach((part, index) => assert.ok(Math.abs(part - rpy[index]) < 1e-9));
  assert.equal(toRpy([0, Math.SQRT1_2 + 1e-9, 0, Math.SQRT1_2 + 1e-9])[1], Math.PI / 2);
  const state = stateOf("box", poseOf([1, 2, 3]));
  assert.deepEqual(state.pose, { position: { x: 1, y: 2, z: 3 }, orientation: { x: 0, y: 0, z: 0, w: 1 } });
  assert.equal(state.reference_frame, "world");
});

test("a push is a force for some time", () => {
  const { wrench, duration, body_name: body } = pushOf("box::link", [5, 0, 0], [0, 0, 0.1], 1.25);
  assert.deepEqual(
    [wrench.force, duration, body],
    [{ x: 5, y: 0, z: 0 }, { secs: 1, nsecs: 250_000_000 }, "box::link"],
  );
  assert.deepEqual(durationOf(0.2), { secs: 0, nsecs: 200_000_000 });
});

test("shapes have the mass and the inertia of their size", () => {
  const number = (text, tag) => Number(new RegExp(`<${tag}>([^<]+)</${tag}>`).exec(text)[1]);
  const box = shapeSdf("box", { "size x": 1, "size y": 2, "size z": 0.5 }, [1, 0.5, 0]);
  assert.equal(number(box, "mass"), 200);
  assert.equal(number(box, "ixx"), (200 * (4 + 0.25)) / 12);
  assert.match(box, /<size>1 2 0.5<\/size>/);
  assert.match(box, /<diffuse>1 0.5 0 1<\/diffuse>/);
  const ball = shapeSdf("sphere", { radius: 0.5 }, [0, 0, 0]);
  assert.ok(Math.abs(number(ball, "izz") - 0.4 * number(ball, "mass") * 0.25) < 1e-9);
  const roll = shapeSdf("cylinder", { radius: 0.5, length: 2 }, [0, 0, 0]);
  assert.ok(Math.abs(number(roll, "izz") - 0.5 * number(roll, "mass") * 0.25) < 1e-9);
  for (const [kind, { sizes }] of Object.entries(SHAPES)) assert.ok(heightOf(kind, sizes) > 0);
});

test("the state is read from a diagnostic status", () => {
  const values = Object.entries({
    time: "61.5",
    real_time_factor: "0.98",
    max_update_rate: "1000.0",
    time_step: "0.001",
  });
  const message = { name: "default", message: "paused", values: values.map(([key, value]) => ({ key, value })) };
  const expected = { world: "default", isPaused: true, time: 61.5, factor: 0.98, rate: 1000, step: 0.001, camera: "" };
  assert.deepEqual(readState(message), expected);
  assert.equal(clockText(3661.25), "01:01:01.250");
  assert.equal(clockText(undefined), "–");
  assert.equal(rateOf(0.5, 0.001), 500);
  assert.equal(rateOf(0, 0.001), 0);
  assert.deepEqual([-0.0001, -1.2345, 2].map(threeDecimals), ["0.000", "-1.234", "2.000"]);
});

test("the camera of a world becomes a view around what it sees of the ground", () => {
  const view = viewOf(["0", "-10", "10", ...fromRpy([0, Math.PI / 4, Math.PI / 2])].join(" "));
  const near = (found, wanted) => assert.ok(Math.abs(found - wanted) < 1e-9, `${found} ${wanted}`);
  view.focus.forEach((part) => near(part, 0));
  near(view.distance, Math.sqrt(200));
  near(view.pitch, Math.PI / 4);
  near(view.yaw, -Math.PI / 2); // where the viewer is
  assert.equal(viewOf("1 2 3 0 0 0 1").distance, 6);
  for (const text of ["", "1 2 3", "1 2 3 0 0 0 nan", "a b c d e f g"]) assert.equal(viewOf(text), null);
});

test("joints and links belong to their model", () => {
  const message = { name: ["arm::a", "arm2::a", "arm::inner::b"], position: [1, 2, 3], velocity: [0, 0, 0.5] };
  assert.deepEqual(jointsOf(message, "arm"), [
    { name: "a", position: 1, velocity: 0 },
    { name: "inner::b", position: 3, velocity: 0.5 },
  ]);
  assert.deepEqual(splitLink("house::room::wall"), ["house", "room::wall"]);
  assert.deepEqual(splitLink("house"), ["house", ""]);
});

test("a simulation is there if its services are", () => {
  const services = new Map(
    ["pause_physics", "get_world_properties", "set_model_state"].map((each) => [`/gazebo/${each}`, {}]),
  );
  assert.ok(isThere(services));
  services.delete("/gazebo/pause_physics");
  assert.ok(!isThere(services));
});
