"""Models that come and go, resets, sensing, and models that explode."""

from __future__ import annotations

import dataclasses
import math
import struct
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="the simulation needs mujoco-core")

from minirospy.core.sdf.model import (
    Axis,
    Box,
    Collision,
    Cylinder,
    Heightmap,
    Inertial,
    Joint,
    Link,
    Material,
    MeshShape,
    Mimic,
    Model,
    Physics,
    Polyline,
    Pose,
    Sphere,
    Vector,
    Visual,
    World,
)
from minirospy.ros.gazebo_ros.physics import Simulation, SimulationError, State
from minirospy.ros.gazebo_ros.physics.shapes import Shapes
from tests.ros.simulation.worlds import GROUND, arm, at, body, diff_drive, pendulum, single, solid, still

G = 9.8


def flat(state: State) -> list[float]:
    return [*state.pose.position, *state.pose.orientation, *state.linear, *state.angular]


def test_adding_and_removing_models_keeps_the_others_states() -> None:
    models = (GROUND, single("first", Sphere(0.1), pose=at(z=9.0)), diff_drive(), pendulum(start=1.0))
    plain, busy = Simulation(World(models=models)), Simulation(World(models=models))
    for simulation in (plain, busy):
        simulation.model("robot").joints["left_joint"].set_velocity(4.0, 5.0)
        simulation.model("pendulum").joints["joint0"].set_force(0.1)
        simulation.step(300)

    busy.add_model(single("guest", Box((0.1, 0.1, 0.1))), at(x=20.0, z=2.0))
    busy.step(200)
    busy.remove_model("guest")
    busy.step(100)
    plain.step(300)

    assert busy.time_ns == plain.time_ns
    for name in ("first", "robot", "pendulum"):
        for key, link in plain.model(name).links.items():
            for left, right in zip(flat(link.state), flat(busy.model(name).links[key].state), strict=True):
                assert left == pytest.approx(right, abs=1e-9)
    left = busy.model("robot").joints["left_joint"]
    assert left.velocity == pytest.approx(4.0, rel=1e-3)
    with pytest.raises(SimulationError, match="no model 'guest'"):
        busy.model("guest")


def test_a_name_is_used_once() -> None:
    simulation = Simulation(World(models=(GROUND,)))
    with pytest.raises(SimulationError, match="there is a model 'ground' already"):
        simulation.add_model(GROUND)


@pytest.mark.parametrize(
    ("model", "text"),
    [
        (Model("empty", {}), "has no links"),
        (Model("bad", {"a": Link("a")}, {"j": Joint("j", "fixed", "a", "b")}), "names no link 'b'"),
        (
            Model("bad", {"a": Link("a")}, {"j": Joint("j", "revolute", "world", "a", axis=Axis((0, 0, 0)))}),
            "axis of length zero",
        ),
        (Model("bad", {"a": Link("a")}, {"j": Joint("j", "screw", "world", "a")}), "unknown type 'screw'"),
        (
            Model("bad", {"a": Link("a", collisions=(Collision("c", MeshShape("/no/such.stl")),))}),
            "/no/such.stl: No such file",
        ),
        (Model("bad", {"a": Link("a")}, pose=at(x=math.nan)), "the pose is not finite"),
        *(
            (
                Model("bad", {"a": Link("a")}, {"j": Joint("j", "revolute", "world", "a", axis=axis)}),
                f"model 'bad': joint 'j' has a {text}",
            )
            for axis, text in (
                (Axis(damping=math.nan), "pose, axis, damping, friction or spring that is not finite"),
                (Axis(damping=math.inf), "pose, axis, damping, friction or spring that is not finite"),
                (Axis(friction=math.inf), "pose, axis, damping, friction or spring that is not finite"),
                (
                    Axis(spring_stiffness=math.inf),
                    "pose, axis, damping, friction or spring that is not finite",
                ),
                (
                    Axis(initial_position=math.nan),
                    "pose, axis, damping, friction or spring that is not finite",
                ),
                (Axis(effort=math.nan), "limit that is NaN"),
                (Axis(velocity=math.nan), "limit that is NaN"),
                (Axis(lower=math.nan), "limit that is NaN"),
            )
        ),
        (Model("bad", {"a": Link("a", Pose((math.nan, 0, 0)))}), "model 'bad': link 'a' has a pose"),
    ],
)
def test_an_invalid_model_is_refused_and_the_world_goes_on(model: Model, text: str) -> None:
    simulation = Simulation(World(models=(GROUND, single("ball", Sphere(0.1), pose=at(z=9.0)))))
    simulation.step(100)

    with pytest.raises(SimulationError, match=text) as caught:
        simulation.add_model(model)

    assert "\n" not in str(caught.value)
    assert list(simulation.models) == ["ground", "ball"]
    simulation.step(100)
    assert simulation.model("ball").state.linear[2] == pytest.approx(-G * 0.2)
    simulation.add_model(single("next", Sphere(0.1)), at(x=2.0))
    assert list(simulation.models) == ["ground", "ball", "next"]


def test_an_invalid_model_of_the_world_is_a_warning() -> None:
    simulation = Simulation(World(models=(Model("empty", {}), GROUND)))
    assert simulation.warnings == ["model 'empty' has no links"]
    assert list(simulation.models) == ["ground"]


def test_a_static_model_can_be_moved_and_stays_there() -> None:
    simulation = Simulation(World(models=(still("shelf", Box((1, 1, 0.2)), at(z=1.0)),)))
    ball = simulation.add_model(single("ball", Sphere(0.1)), at(x=5.0, z=3.0))
    shelf = simulation.model("shelf")
    shelf.set_state(shelf.state._replace(pose=at(x=5.0, z=2.0)))
    simulation.add_model(single("other", Sphere(0.1)), at(x=9.0))

    simulation.step(2000)

    assert shelf.pose == at(x=5.0, z=2.0)
    assert ball.pose.position[2] == pytest.approx(2.2, abs=0.002)


def test_moving_a_model_keeps_its_joint_angles() -> None:
    simulation = Simulation(World(models=(GROUND, arm(3))))
    model = simulation.model("arm")
    model.joints["joint1"].set_state(0.5)
    tip = model.links["link2"].pose
    model.set_state(model.state._replace(pose=at(x=1.0)))

    assert model.joints["joint1"].position == 0.5
    assert model.links["link2"].pose.position == pytest.approx(
        (tip.position[0] + 1.0, tip.position[1], tip.position[2])
    )


def test_moving_a_link_moves_its_model() -> None:
    simulation = Simulation(World(models=(diff_drive(),)))
    robot = simulation.model("robot")
    wheel = robot.links["left"]
    wheel.set_state(wheel.state._replace(pose=wheel.pose._replace(position=(0.0, 1.15, 0.05))))
    assert robot.pose.position == pytest.approx((0.0, 1.0, 0.0), abs=1e-12)


def test_reset_returns_models_and_keeps_or_resets_the_time() -> None:
    simulation = Simulation(World(models=(GROUND, diff_drive(), pendulum(start=0.4))))
    late = simulation.add_model(single("late", Sphere(0.1)), at(x=3.0, z=4.0))
    robot = simulation.model("robot")
    robot.joints["left_joint"].set_velocity(5.0, 5.0)
    simulation.step(500)

    simulation.reset_models()

    assert simulation.time == 0.5
    assert late.pose == at(x=3.0, z=4.0)
    assert robot.pose.position == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)
    assert robot.joints["left_joint"].velocity == 0.0
    assert simulation.model("pendulum").joints["joint0"].position == 0.4
    simulation.step(200)
    assert robot.joints["left_joint"].velocity == pytest.approx(0.0, abs=1e-3)

    simulation.reset()
    assert simulation.time == 0.0


@pytest.mark.parametrize("reason", ["is faster than 100 km/s", "became NaN"])
def test_an_exploding_model_is_removed_and_named(reason: str, capfd: pytest.CaptureFixture[str]) -> None:
    simulation = Simulation(World(models=(GROUND, single("ball", Sphere(0.1), pose=at(z=5.0)))))
    simulation.add_model(single("bomb", Sphere(0.1)), at(x=5.0, z=1.0))
    simulation.step(100)
    if reason == "became NaN":
        simulation.engine.data.qvel[6:12] = math.nan
    else:
        simulation.model("bomb").canonical_link.push((1e12, 0.0, 0.0))

    lost = simulation.step(100)

    assert [(each.name, each.reason) for each in lost] == [("bomb", f"{reason}: removed")]
    assert list(simulation.models) == ["ground", "ball"]
    assert simulation.model("ball").state.linear[2] == pytest.approx(-G * 0.199, rel=0.01)
    output = capfd.readouterr()
    assert output.out + output.err == ""


@pytest.mark.parametrize("force", [1e9, 1e150, 1e300, 1.7e308])
@pytest.mark.parametrize("direction", [(1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)])
def test_a_huge_force_removes_only_the_model_on_which_it_acts(force: float, direction: Vector) -> None:
    boxes = [
        single(name, Box((0.3, 0.3, 0.3)), pose=at(z=z))
        for name, z in zip("abc", (0.15, 0.45, 0.75), strict=True)
    ]
    simulation = Simulation(World(models=(GROUND, *boxes)))
    simulation.step(200)
    x, y, z = direction
    simulation.model("b").canonical_link.add_wrench((force * x, force * y, force * z), duration=1.0)

    lost = simulation.step(300)

    assert [each.name for each in lost] == ["b"]
    assert simulation.model("a").pose.position == pytest.approx((0.0, 0.0, 0.15), abs=1e-3)
    assert simulation.model("c").pose.position == pytest.approx((0.0, 0.0, 0.45), abs=1e-2)


def test_a_huge_joint_effort_removes_only_the_model_on_which_it_acts() -> None:
    other = dataclasses.replace(pendulum(), name="other")
    simulation = Simulation(World(models=(pendulum(2), other)))
    simulation.model("pendulum").joints["joint1"].add_force(1e300)
    assert [each.name for each in simulation.step(300)] == ["pendulum"]
    assert abs(simulation.model("other").joints["joint0"].position) < 0.2


def test_forces_and_states_that_are_not_finite_are_refused() -> None:
    simulation = Simulation(World(models=(pendulum(),)))
    model = simulation.model("pendulum")
    joint, link = model.joints["joint0"], model.canonical_link
    bad = at(x=math.nan)
    for call in (
        lambda: joint.set_force(math.inf),
        lambda: joint.add_force(math.nan),
        lambda: joint.set_velocity(math.nan),
        lambda: joint.set_velocity(1.0, math.nan),
        lambda: joint.set_position(math.nan),
        lambda: joint.set_state(math.nan),
        lambda: joint.set_axis(Axis(damping=math.nan)),
        lambda: joint.set_axis(Axis(damping=math.inf)),
        lambda: joint.set_axis(Axis(friction=math.nan)),
        lambda: joint.set_axis(Axis(lower=math.nan)),
        lambda: joint.set_axis(Axis(upper=math.nan)),
        lambda: link.push((math.nan, 0.0, 0.0)),
        lambda: link.add_wrench(torque=(math.inf, 0.0, 0.0)),
        lambda: model.set_state(State(bad)),
        lambda: link.set_state(State(bad)),
        lambda: model.set_velocity((0.0, math.nan, 0.0), (0.0, 0.0, 0.0)),
    ):
        with pytest.raises(SimulationError, match=r"^pendulum(::joint0|::rod0)?: .* is not finite$"):
            call()
    joint.set_velocity(1.0, 1.0)
    assert simulation.step(10) == []


def test_a_model_that_leaves_the_world_is_removed_and_named() -> None:
    simulation = Simulation(World(models=(GROUND, single("rocket", Sphere(0.1), pose=at(z=5.0)))))
    simulation.model("rocket").set_velocity((0.0, 0.0, 99_000.0), (0.0, 0.0, 0.0))

    lost = simulation.step(1500)

    assert [(each.name, each.reason) for each in lost] == [("rocket", "is more than 100 km away: removed")]


def test_a_turning_wheel_never_leaves_the_world() -> None:
    simulation = Simulation(World(models=(pendulum(),)))
    simulation.model("pendulum").joints["joint0"].set_state(2e5)
    assert simulation.step(10) == []


def test_invalid_inertias_are_mended() -> None:
    link = Link("link", inertial=Inertial(0.0, inertia=(0.0, 0.3, 0.0, 5.0, 0.0, -1.0)))
    simulation = Simulation(World(models=(Model("odd", {"link": link}),)))
    assert simulation.warnings == []
    assert simulation.step(100) == []


def test_rays_hit_within_a_millimetre() -> None:
    models = (
        GROUND,
        still("box", Box((1.0, 1.0, 1.0)), at(x=3.0)),
        still("post", Cylinder(0.25, 2.0), at(y=2.0)),
        still("ball", Sphere(0.5), at(x=-4.0, z=0.3)),
    )
    simulation = Simulation(World(models=models))
    angles = np.linspace(-math.pi, math.pi, 361)
    directions = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)

    hits = simulation.cast_rays(at(z=0.3, yaw=0.5), directions, 10.0)

    expected = {0: (2.5, "box"), 90: (1.75, "post"), 180: (3.5, "ball"), 45: (math.inf, "")}
    for degrees, (distance, name) in expected.items():
        index = 180 + degrees
        heading = angles[index]
        direction = np.array([[math.cos(heading - 0.5), math.sin(heading - 0.5), 0.0]])
        hit = simulation.cast_rays(at(z=0.3, yaw=0.5), direction, 10.0)
        assert hit.distances[0] == pytest.approx(distance, abs=0.001)
        assert hit.collisions[0].partition("::")[0] == name
    assert hits.distances.shape == (361,)

    down = np.array([[math.sin(0.5), 0.0, -math.cos(0.5)]])
    floor = simulation.cast_rays(at(y=-5.0, z=1.0), down, 10.0)
    assert floor.distances[0] == pytest.approx(1.0 / math.cos(0.5), abs=0.001)
    assert floor.collisions == ("ground::link::plane",)


def test_rays_begin_at_the_smallest_range() -> None:
    simulation = Simulation(
        World(models=(still("housing", Sphere(0.05)), still("wall", Box((1, 9, 9)), at(x=2.5))))
    )
    forward = np.array([[1.0, 0.0, 0.0]])
    assert simulation.cast_rays(at(), forward, 5.0).distances[0] == pytest.approx(0.05)
    assert simulation.cast_rays(at(), forward, 5.0, min_range=0.1).distances[0] == pytest.approx(2.0)
    assert simulation.cast_rays(at(), forward, 5.0, exclude="housing::link").distances[0] == pytest.approx(
        2.0
    )
    assert simulation.cast_rays(at(), forward, 1.0, min_range=0.1).distances[0] == math.inf


def test_rays_that_leave_a_housing_meet_what_is_behind_it() -> None:
    """Hidden: the housing and the ball in it. Not hidden: a wall that is nearer than the smallest range."""
    models = (
        GROUND,
        still("housing", Cylinder(0.05, 0.07), at(z=0.5)),
        still("ball", Sphere(0.02), at(x=0.1, z=0.5)),
        still("wall", Box((0.1, 9.0, 9.0)), at(x=2.05)),
        still("near", Box((0.1, 9.0, 9.0)), at(y=-0.2)),
        still("far", Box((0.1, 9.0, 9.0)), at(x=-3.05)),
    )
    simulation = Simulation(World(models=models))
    groups = simulation.engine.model.geom_group.copy()
    angles = np.linspace(-math.pi, math.pi, 720, endpoint=False)
    directions = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)

    hits = simulation.cast_rays(at(z=0.5), directions, 20.0, min_range=0.3)

    with np.errstate(divide="ignore"):
        expected = np.where(np.cos(angles) > 0, 2.0 / np.cos(angles), -3.0 / np.cos(angles))
    is_seen = np.sin(angles) >= 0
    inside = is_seen & (expected < 4.5)
    assert hits.distances[inside] == pytest.approx(expected[inside], abs=1e-3)
    assert {each.partition("::")[0] for each, seen in zip(hits.collisions, inside, strict=True) if seen} == {
        "wall",
        "far",
    }
    # Each ray is as if it had been cast alone.
    for index in range(0, 720, 30):
        alone = simulation.cast_rays(at(z=0.5), directions[index : index + 1], 20.0, min_range=0.3)
        assert alone.distances[0] == hits.distances[index]
        assert alone.collisions[0] == hits.collisions[index]
    assert (simulation.engine.model.geom_group == groups).all()


def test_rays_see_wheels_as_cylinders() -> None:
    simulation = Simulation(World(models=(diff_drive(),)))
    hit = simulation.cast_rays(at(y=1.0, z=0.02), np.array([[0.0, -1.0, 0.0]]), 5.0)
    assert hit.distances[0] == pytest.approx(1.0 - 0.165, abs=1e-6)
    assert hit.collisions == ("robot::left::shape",)


def test_contacts_name_the_collisions_and_carry_the_weight() -> None:
    simulation = Simulation(World(models=(GROUND, single("box", Box((0.2, 0.2, 0.2)), 2.0, at(z=0.1)))))
    simulation.records_details = True
    simulation.step(500)

    (contact,) = simulation.contacts()

    names = (contact.collision1, contact.collision2)
    assert sorted(names) == ["box::link::shape", "ground::link::plane"]
    sign = 1.0 if names[0].startswith("box") else -1.0
    assert sum(wrench.force[2] for wrench in contact.wrenches) == pytest.approx(sign * 2.0 * G, rel=1e-3)
    assert all(normal == pytest.approx((0.0, 0.0, sign), abs=1e-6) for normal in contact.normals)
    assert len(contact.positions) == len(contact.depths) == 4


def test_a_joint_measures_the_force_that_it_carries() -> None:
    link = Link("weight", at(x=0.5, z=1.0), solid(2.0, Box((0.1, 0.1, 0.1))))
    base = Link("base", at(z=1.0))
    joints = {
        "stand": Joint("stand", "fixed", "world", "base"),
        "sensor": Joint("sensor", "fixed", "base", "weight", at(x=-0.5)),
    }
    simulation = Simulation(World(models=(Model("scale", {"base": base, "weight": link}, joints),)))
    simulation.records_details = True
    simulation.step(10)

    wrench = simulation.model("scale").joints["sensor"].wrench()

    assert wrench.force == pytest.approx((0.0, 0.0, -2.0 * G), abs=1e-6)
    assert wrench.torque == pytest.approx((0.0, 2.0 * G * 0.5, 0.0), abs=1e-6)


def test_links_of_a_model_collide_only_if_asked() -> None:
    for collides in (False, True):
        links = {
            "low": body("low", Box((1, 1, 0.2)), 1.0, at(z=0.1)),
            "high": body("high", Box((0.2, 0.2, 0.2)), 1.0, at(z=0.5)),
        }
        model = Model("pair", links, self_collide=collides)
        simulation = Simulation(World(models=(GROUND, model)))
        simulation.step(2000)
        height = simulation.model("pair").links["high"].pose.position[2]
        assert height == pytest.approx(0.3 if collides else 0.1, abs=0.002)


def test_joined_links_do_not_collide_even_if_asked() -> None:
    model = pendulum(2)
    links = {
        name: Link(name, link.pose, link.inertial, (Collision("c", Box((0.1, 0.1, 0.8))),))
        for name, link in model.links.items()
    }
    simulation = Simulation(World(models=(Model("pendulum", links, model.joints, self_collide=True),)))
    simulation.records_details = True
    simulation.step(10)
    assert simulation.contacts() == []


def test_a_loop_stays_closed() -> None:
    """Four bars: the last one's end is joined to the world."""
    rod = solid(1.0, Box((0.02, 0.02, 0.5)))
    links = {
        "a": Link("a", at(z=1.0), rod._replace(pose=at(z=-0.25))),
        "b": Link("b", at(z=0.5), rod._replace(pose=at(x=0.25))),
        "c": Link("c", at(x=0.5, z=0.5), rod._replace(pose=at(z=0.25))),
    }
    axis = Axis((0, 1, 0))
    joints = {
        "a": Joint("a", "continuous", "world", "a", axis=axis),
        "b": Joint("b", "continuous", "a", "b", axis=axis),
        "c": Joint("c", "continuous", "b", "c", axis=axis),
        "loop": Joint("loop", "continuous", "world", "c", at(z=0.5), axis=axis),
    }
    simulation = Simulation(World(models=(Model("bars", links, joints),)))
    bars = simulation.model("bars")
    bars.joints["a"].set_velocity(1.0)

    simulation.step(300)

    assert bars.joints["a"].position == pytest.approx(0.3, abs=0.002)
    assert bars.joints["loop"].position == 0.0
    x, _, z = bars.links["c"].pose.position
    assert math.dist((x, z), (0.5, 1.0)) == pytest.approx(0.5, abs=0.001)
    assert (x, z) == pytest.approx((0.5 - 0.5 * math.sin(0.3), 1.0 - 0.5 * math.cos(0.3)), abs=0.003)


def test_a_mimic_joint_follows() -> None:
    model = pendulum(2)
    joints = dict(model.joints)
    joints["joint1"] = Joint(
        "joint1", "continuous", "rod0", "rod1", axis=Axis((0, 1, 0)), mimic=Mimic("joint0", 2.0, 0.1)
    )
    simulation = Simulation(World(models=(Model("pair", model.links, joints),)))
    pair = simulation.model("pair").joints
    pair["joint0"].set_position(0.3)

    simulation.step(500)

    assert pair["joint1"].position == pytest.approx(0.7, abs=0.003)


def test_universal_and_ball_joints() -> None:
    for kind in ("universal", "ball"):
        link = Link("rod", at(z=1.0), solid(1.0, Box((0.02, 0.02, 0.5)))._replace(pose=at(z=-0.25)))
        axes = {"axis": Axis((1, 0, 0)), "axis2": Axis((0, 1, 0))}
        model = Model("rod", {"rod": link}, {"j": Joint("j", kind, "world", "rod", **axes)})
        simulation = Simulation(World(models=(model,)))
        rod = simulation.model("rod")
        if kind == "universal":
            assert rod.joints["j"].second is not None
            rod.joints["j"].second.set_position(0.3)
            simulation.step(200)
            assert rod.joints["j"].second.position == pytest.approx(0.3, abs=1e-3)
        simulation.step(200)
        assert rod.links["rod"].pose.position == pytest.approx((0.0, 0.0, 1.0), abs=1e-6)


def test_a_world_without_models_runs() -> None:
    simulation = Simulation()
    assert simulation.step(10) == []
    assert simulation.time_ns == 10_000_000


def test_invalid_physics_are_refused() -> None:
    simulation = Simulation()
    for physics in (
        Physics(step=0.0),
        Physics(step=4e-10),
        Physics(step=math.nan),
        Physics(gravity=(0.0, 0.0, math.inf)),
        Physics(update_rate=math.nan),
    ):
        with pytest.raises(SimulationError, match="the step must be positive"):
            simulation.set_physics(physics)


def write_stl(path: Path, triangles: list[list[tuple[float, float, float]]]) -> str:
    """Write a binary STL file."""
    data = bytes(80) + struct.pack("<I", len(triangles))
    for corners in triangles:
        data += struct.pack("<12fH", 0, 0, 0, *(value for corner in corners for value in corner), 0)
    path.write_bytes(data)
    return str(path)


def quads(*faces: list[tuple[float, float, float]]) -> list[list[tuple[float, float, float]]]:
    return [triangle for a, b, c, d in faces for triangle in ([a, b, c], [a, c, d])]


def room() -> list[list[tuple[float, float, float]]]:
    """Return the inner surface of a room of 4 m x 4 m x 1 m without a ceiling."""
    a, b, c, d = (-2, -2), (2, -2), (2, 2), (-2, 2)
    walls = [[(*q, 0), (*p, 0), (*p, 1), (*q, 1)] for p, q in ((a, b), (b, c), (c, d), (d, a))]
    return quads([(*a, 0), (*b, 0), (*c, 0), (*d, 0)], *walls)


def test_a_robot_drives_in_a_room_that_is_one_mesh(tmp_path: Path) -> None:
    path = write_stl(tmp_path / "room.stl", room())
    simulation = Simulation(World(models=(still("room", MeshShape(path)), diff_drive())))
    assert simulation.warnings == []
    robot = simulation.model("robot")
    simulation.step(500)
    assert robot.pose.position == pytest.approx((0.0, 0.0, 0.0), abs=0.003)

    angles = np.arange(0, 2 * math.pi, 0.1)
    directions = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    hits = simulation.cast_rays(at(z=0.5), directions, 10.0)
    expected = 2.0 / np.maximum(abs(np.cos(angles)), abs(np.sin(angles)))
    assert hits.distances == pytest.approx(expected, abs=0.001)
    assert set(hits.collisions) == {"room::link::shape"}

    for side in ("left_joint", "right_joint"):
        robot.joints[side].set_velocity(10.0, 5.0)
    simulation.records_details = True
    simulation.step(8000)
    x, y, z = robot.pose.position
    assert x == pytest.approx(2.0 - 0.15, abs=0.03)
    assert abs(y) < 0.1
    assert abs(z) < 0.05
    assert {contact.collision1 for contact in simulation.contacts()} | {
        contact.collision2 for contact in simulation.contacts()
    } >= {"room::link::shape", "robot::base::shape"}


def test_a_model_that_mujoco_refuses_leaves_the_others(tmp_path: Path) -> None:
    """MuJoCo refuses a mesh that is too small. It must not stay in the spec, and fail each later compilation."""
    small = [[(x * 1e-9, y * 1e-9, z * 1e-9) for x, y, z in corners] for corners in room()]
    tiny = write_stl(tmp_path / "small.stl", small)
    rooms = write_stl(tmp_path / "room.stl", room())
    models = [
        still(name, MeshShape(path)) for name, path in (("first", rooms), ("bad", tiny), ("last", rooms))
    ]

    simulation = Simulation(World(models=(GROUND, *models)))

    assert list(simulation.models) == ["ground", "first", "last"]
    assert len(simulation.warnings) == 1
    assert simulation.warnings[0].startswith("model 'bad': ")
    with pytest.raises(SimulationError, match="mesh"):
        simulation.add_model(single("bad", MeshShape(tiny)))
    simulation.add_model(still("more", MeshShape(rooms, scale=(2.0, 2.0, 2.0))))


def test_meshes_of_a_model_that_is_refused_halfway_do_not_stay(tmp_path: Path) -> None:
    small = [[(x * 1e-9, y * 1e-9, z * 1e-9) for x, y, z in corners] for corners in room()]
    tiny = write_stl(tmp_path / "small.stl", small)
    (tmp_path / "broken.obj").write_text("f 1 2 3\n")
    links = {
        name: Link(name, collisions=(Collision("c", MeshShape(path)),))
        for name, path in (("first", tiny), ("second", str(tmp_path / "broken.obj")))
    }
    bad = Model("bad", links, is_static=True)
    simulation = Simulation(World(models=(GROUND,)))
    with pytest.raises(SimulationError, match=r"broken\.obj"):
        simulation.add_model(bad)
    simulation.add_model(single("ball", Sphere(0.1)))

    simulation = Simulation(World(models=(GROUND, bad, single("ball", Sphere(0.1)))))
    assert list(simulation.models) == ["ground", "ball"]
    assert len(simulation.warnings) == 1


def test_a_mesh_without_area_is_named(tmp_path: Path) -> None:
    line = write_stl(tmp_path / "line.stl", [[(0, 0, 0), (1, 0, 0), (2, 0, 0)]])
    simulation = Simulation(World(models=(GROUND,)))
    for model in (single("bad", MeshShape(line)), still("bad", MeshShape(line))):
        with pytest.raises(SimulationError, match="the mesh has no area"):
            simulation.add_model(model)


def test_a_material_on_one_triangle_or_without_area_leaves_the_world(tmp_path: Path) -> None:
    (tmp_path / "board.obj").write_text(
        "mtllib board.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\n"
        "usemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\nf 1 2 3\nusemtl none\nf 1 2 5\n"
    )
    (tmp_path / "board.mtl").write_text("newmtl a\nnewmtl b\nnewmtl none\n")
    board = Link("link", visuals=(Visual("v", MeshShape(str(tmp_path / "board.obj"))),))
    simulation = Simulation(World(models=(GROUND, Model("board", {"link": board}, is_static=True))))
    simulation.add_visuals()
    simulation.add_model(single("ball", Sphere(0.1)))
    simulation.remove_model("board")
    assert simulation.warnings == []


def test_a_visual_that_mujoco_refuses_leaves_the_others(tmp_path: Path) -> None:
    ball = Link("link", visuals=(Visual("v", Sphere(0.1)), Visual("mesh", MeshShape("/no/such.dae"))))
    bad = Link("link", visuals=(Visual("first", Sphere(0.1)), Visual("v", Sphere(math.nan))))
    models = [Model(name, {"link": link}) for name, link in (("a", ball), ("bad", bad), ("b", ball))]
    simulation = Simulation(World(models=tuple(models)))

    simulation.add_visuals()

    unread = "visual 'mesh': /no/such.dae: No such file or directory"
    assert simulation.warnings[:2] == [f"model 'a': {unread}", f"model 'b': {unread}"]
    (line,) = simulation.warnings[2:]
    assert line.startswith("model 'bad' is not shown: ")
    assert simulation.engine.model.ngeom == 2
    simulation.step()
    simulation.remove_model("bad")
    simulation.add_model(Model("c", {"link": ball}))
    assert simulation.engine.model.ngeom == 3


def test_a_moving_mesh_collides_as_the_hulls_of_its_parts(tmp_path: Path) -> None:
    def box(x: float) -> list[list[tuple[float, float, float]]]:
        low, high = -0.1, 0.1
        p = [(x + i, j, k) for k in (low, high) for j in (low, high) for i in (low, high)]
        faces = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (1, 3, 7, 5), (3, 2, 6, 7), (2, 0, 4, 6))
        return quads(*([p[index] for index in face] for face in faces))

    path = write_stl(tmp_path / "pair.stl", box(-0.5) + box(0.5))
    shape = MeshShape(path)
    link = Link("link", inertial=solid(2.0, Box((1.2, 0.2, 0.2))), collisions=(Collision("c", shape),))
    simulation = Simulation(World(models=(GROUND, Model("pair", {"link": link}))))
    simulation.model("pair").set_state(simulation.model("pair").state._replace(pose=at(z=0.2)))
    simulation.step(1000)
    assert simulation.model("pair").pose.position[2] == pytest.approx(0.1, abs=0.002)

    # Between the parts there is nothing.
    ball = simulation.add_model(single("ball", Sphere(0.1), 0.1), at(z=1.0))
    simulation.step(2000)
    assert ball.pose.position[2] == pytest.approx(0.1, abs=0.002)


def test_a_polyline_is_a_prism() -> None:
    points = ((0, 0), (1, 0), (1, 0.2), (0.2, 0.2), (0.2, 1), (0, 1))
    simulation = Simulation(World(models=(GROUND, still("corner", Polyline(points, 0.5)))))
    down = np.array([[0.0, 0.0, -1.0]])
    assert simulation.cast_rays(at(0.1, 0.1, 2.0), down, 5.0).distances[0] == pytest.approx(1.5, abs=1e-6)
    assert simulation.cast_rays(at(0.6, 0.6, 2.0), down, 5.0).distances[0] == pytest.approx(2.0, abs=1e-6)
    ball = simulation.add_model(single("ball", Sphere(0.1)), at(0.6, 0.6, 1.0))
    other = simulation.add_model(single("other", Sphere(0.05)), at(0.1, 0.5, 1.0))
    simulation.step(2000)
    assert ball.pose.position[2] == pytest.approx(0.1, abs=0.002)
    assert other.pose.position[2] == pytest.approx(0.55, abs=0.002)


def test_a_heightmap_is_a_terrain(tmp_path: Path) -> None:
    image = pytest.importorskip("PIL.Image", reason="heightmaps need Pillow")
    columns = np.arange(65)
    heights = np.tile(100 + 2 * columns, (65, 1)).astype(np.uint8)  # rises with x from 100 to 228
    image.fromarray(heights).save(tmp_path / "slope.png")
    shape = Heightmap(str(tmp_path / "slope.png"), (8.0, 8.0, 2.0), (0.0, 0.0, 1.0))
    simulation = Simulation(World(models=(still("terrain", shape),)))
    assert simulation.warnings == []

    down = np.array([[0.0, 0.0, -1.0]])
    for x in (-3.0, 0.5, 3.0):
        hit = simulation.cast_rays(at(x, 1.0, 10.0), down, 20.0)
        expected = 1.0 + 2.0 * (100 + 128 * (x + 4) / 8) / 228
        assert 10.0 - hit.distances[0] == pytest.approx(expected, abs=0.001)

    ball = simulation.add_model(single("ball", Sphere(0.1)), at(2.0, 0.0, 4.0))
    simulation.step(3000)
    assert ball.pose.position[0] < 1.0  # it rolls down


def test_a_heightmap_of_elevations_keeps_them(tmp_path: Path) -> None:
    image = pytest.importorskip("PIL.Image", reason="heightmaps need Pillow")
    heights = np.tile(np.linspace(-1.0, 5.0, 65), (65, 1)).astype(np.float32)  # rises with x
    heights[0, :10] = -99999.0  # no data
    image.fromarray(heights).save(tmp_path / "slope.tif")
    simulation = Simulation(
        World(models=(still("terrain", Heightmap(str(tmp_path / "slope.tif"), (8.0, 8.0, 5.0))),))
    )

    down = np.array([[0.0, 0.0, -1.0]])
    for x in (-3.6, -2.0, 0.5, 3.0):
        hit = simulation.cast_rays(at(x, 1.0, 10.0), down, 20.0)
        assert 10.0 - hit.distances[0] == pytest.approx(max(6.0 * (x + 4) / 8 - 1.0, 0.0), abs=0.001)


def test_an_unreadable_heightmap_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "no.png").write_bytes(b"no picture")
    with pytest.raises(SimulationError, match="the heightmap cannot be read"):
        Simulation().add_model(still("terrain", Heightmap(str(tmp_path / "no.png"))))


def test_pictures_that_are_too_large_for_pillow_are_named(tmp_path: Path) -> None:
    image = pytest.importorskip("PIL.Image", reason="pictures need Pillow")
    path = str(tmp_path / "large.png")
    image.new("1", (20000, 10000)).save(path)
    simulation = Simulation(World(models=(GROUND,)))
    with pytest.raises(SimulationError, match="the heightmap cannot be read"):
        simulation.add_model(still("terrain", Heightmap(path)))

    simulation.add_visuals()
    shown = Link("link", visuals=(Visual("v", Sphere(0.1), material=Material(texture=path)),))
    simulation.add_model(Model("ball", {"link": shown}))
    (line,) = simulation.warnings
    assert line.startswith(f"model 'ball': the picture {path} is not shown: ")


def test_an_error_while_a_model_is_built_leaves_nothing_of_it(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*arguments: object, **options: object) -> None:
        raise RuntimeError("no memory")

    simulation = Simulation(World(models=(GROUND,)))
    with monkeypatch.context() as patched:
        patched.setattr(Shapes, "add_collision", fail)
        with pytest.raises(RuntimeError):
            simulation.add_model(single("ball", Sphere(0.1)))
    simulation.add_model(single("ball", Sphere(0.1)))
    assert list(simulation.models) == ["ground", "ball"]


def test_mass_and_joint_can_be_changed() -> None:
    simulation = Simulation(World(models=(pendulum(start=0.0), diff_drive())))
    simulation.step(100)
    pendulum_model, robot = simulation.model("pendulum"), simulation.model("robot")
    joint = pendulum_model.joints["joint0"]
    joint.set_state(0.2, 1.0)
    before = robot.pose

    joint.set_axis(Axis(damping=3.0, effort=2.0))
    heavy = joint.model.links["rod0"].record.inertial._replace(mass=5.0)
    joint.model.links["rod0"].set_inertial(heavy)

    assert (joint.position, joint.velocity) == (0.2, 1.0)
    assert robot.pose == before
    inertia = 0.5**2 / 12 + 5.0 * 0.25**2
    simulation.step()
    assert joint.velocity == pytest.approx(
        1.0 - 0.001 * (3.0 * 1.0 + 5.0 * G * 0.25 * math.sin(0.2)) / inertia, abs=2e-4
    )
    with pytest.raises(SimulationError, match="a mass must be positive"):
        joint.model.links["rod0"].set_inertial(heavy._replace(mass=0.0))
