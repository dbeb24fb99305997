// Controllers of ros_control: managers, limits, times of motions.
import assert from "node:assert/strict";
import { test } from "node:test";

import {
  descriptionOf,
  jointsOf,
  limitsOf,
  managersOf,
  namespaceOf,
  secondsOf,
  unloadedOf,
} from "../../../minirospy/web/dashboard/page/js/control.js";

const CALLS = ["list_controllers", "load_controller", "unload_controller", "switch_controller"];
const manager = (name, calls = CALLS) =>
  calls.map((call) => [`${name}/${call}`, { type: "controller_manager_msgs/X" }]);

test("a manager has all calls of the right types, in any namespace", () => {
  const services = new Map([
    ...manager("/b/controller_manager"),
    ...manager("/controller_manager"),
    ...manager("/half", CALLS.slice(1)),
    ...manager("/other").map(([name]) => [name, { type: "std_srvs/Empty" }]),
    ["/list_controllers", { type: "controller_manager_msgs/ListControllers" }],
  ]);
  assert.deepEqual(managersOf(services), ["/b/controller_manager", "/controller_manager"]);
  assert.equal(namespaceOf("/controller_manager"), "/");
  assert.equal(namespaceOf("/a/b/controller_manager"), "/a/b/");
});

test("controllers of the parameter server are those with a type directly below the namespace", () => {
  const parameters = new Map([
    ["/arm/b/type", "position_controllers/JointTrajectoryController"],
    ["/arm/a/type", "x/Y"],
    ["/arm/a/gains/type", "no"],
    ["/arm/loaded/type", "x/Y"],
    ["/arm/number/type", 5],
    ["/armature/c/type", "x/Y"],
    ["/arm/type", "no"],
  ]);
  assert.deepEqual(unloadedOf("/arm/controller_manager", parameters, ["loaded"]), [
    { name: "a", type: "x/Y" },
    { name: "b", type: "position_controllers/JointTrajectoryController" },
  ]);
});

test("robot_description is searched upwards", () => {
  const parameters = new Map([
    ["/robot_description", "root"],
    ["/a/robot_description", "a"],
  ]);
  assert.equal(descriptionOf("/a/b/", parameters), "a");
  assert.equal(descriptionOf("/c/", parameters), "root");
  assert.equal(descriptionOf("/", parameters), "root");
  assert.equal(descriptionOf("/c/", new Map()), undefined);
});

test("limits are those of the URDF, the narrower of a safety_controller, and a circle for continuous joints", () => {
  const joint = (name, type, inside) => `<joint name="${name}" type="${type}">${inside}</joint>`;
  const limits = limitsOf(`<robot name="r">
    ${joint("turn", "continuous", '<limit effort="1" velocity="2"/>')}
    ${joint("bend", "revolute", '<limit lower="-1" upper="2" effort="1" velocity="0.5"/><safety_controller soft_lower_limit="-0.5" soft_upper_limit="3" k_velocity="1"/>')}
    ${joint("lift", "prismatic", '<limit lower="0" upper="0.4" effort="1" velocity="0.1"/>')}
    ${joint("slow", "revolute", '<limit lower="0" upper="1" effort="1" velocity="0"/>')}
    ${joint("open", "revolute", '<limit effort="1" velocity="1"/>')}
    ${joint("free", "continuous", "")}
    ${joint("fixed", "fixed", '<limit lower="0" upper="1" velocity="1"/>')}
    ${joint("copy", "revolute", '<limit lower="0" upper="1" velocity="1"/><mimic joint="bend"/>')}
  </robot>`);
  assert.deepEqual(Object.fromEntries(limits), {
    turn: { lower: -Math.PI, upper: Math.PI, velocity: 2, isPrismatic: false },
    bend: { lower: -0.5, upper: 2, velocity: 0.5, isPrismatic: false },
    lift: { lower: 0, upper: 0.4, velocity: 0.1, isPrismatic: true },
  });
  assert.throws(() => limitsOf("<robot>"), /is missing/);
});

test("a motion lasts as long as its slowest joint needs, longer at a lower speed", () => {
  const joints = [
    { position: 0, command: 1, velocity: 0.25 },
    { position: 0, command: -1, velocity: 2 },
  ];
  assert.equal(secondsOf(joints, 1), 4);
  assert.equal(secondsOf(joints, 0.5), 8);
  assert.equal(secondsOf([{ position: 1, command: 1, velocity: 1 }], 0.5), 1);
});

test("the joints of a controller are those of its first interface", () => {
  const resources = ["b", "a"];
  assert.deepEqual(jointsOf({ claimed_resources: [{ resources }, { resources: ["c"] }] }), ["b", "a"]);
  assert.deepEqual(jointsOf({ claimed_resources: [] }), []);
});
