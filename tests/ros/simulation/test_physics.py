"""The physics of the simulation against closed forms."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="the simulation needs mujoco-core")

from minirospy.core.sdf.model import (
    IDENTITY,
    Axis,
    Box,
    Cylinder,
    Joint,
    Link,
    Model,
    Physics,
    Plane,
    Pose,
    Sphere,
    Surface,
    Vector,
    World,
)
from minirospy.core.sdf.poses import compose, rotate
from minirospy.ros.gazebo_ros.physics import Simulation, State
from tests.ros.simulation.worlds import (
    GROUND,
    arm,
    at,
    body,
    diff_drive,
    four_wheels,
    pendulum,
    single,
    still,
)

G = 9.8


def tilted(angle: float) -> Pose:
    return Pose((0.0, 0.0, 0.0), (0.0, math.sin(angle / 2), 0.0, math.cos(angle / 2)))


def test_a_falling_ball_follows_the_parabola() -> None:
    simulation = Simulation(World(models=(single("ball", Sphere(0.1), pose=at(1.0, 2.0, 100.0)),)))
    ball = simulation.model("ball")
    ball.set_velocity((1.0, 0.0, 0.0), (0.0, 0.0, 0.0))

    simulation.step(2000)

    x, y, z = ball.pose.position
    assert simulation.time == 2.0
    assert (x, y) == (pytest.approx(3.0, abs=1e-9), pytest.approx(2.0, abs=1e-9))
    assert z == pytest.approx(100 - G * 2.0**2 / 2, abs=0.01)  # half a step of the velocity
    assert ball.state.linear[2] == pytest.approx(-G * 2.0, rel=1e-9)


def test_a_pendulum_has_its_period() -> None:
    start, length = 0.1, 0.5
    simulation = Simulation(World(models=(pendulum(start=start, length=length),)))
    joint = simulation.model("pendulum").joints["joint0"]

    crossings: list[float] = []
    previous = joint.position
    while len(crossings) < 21:
        simulation.step()
        if previous > 0 >= joint.position:
            share = previous / (previous - joint.position)
            crossings.append(simulation.time - (1 - share) * simulation.physics.step)
        previous = joint.position

    period = (crossings[-1] - crossings[0]) / 20
    expected = 2 * math.pi * math.sqrt(2 * length / (3 * G)) * (1 + start**2 / 16)
    assert period == pytest.approx(expected, rel=0.003)


@pytest.mark.parametrize("mu", [0.3, 0.8])
def test_a_box_rests_below_the_angle_of_friction(mu: float) -> None:
    slope = tilted(0.9 * math.atan(mu))
    simulation = Simulation(World(models=(still("slope", Box((20, 5, 0.2)), slope, mu=100.0),)))
    box = simulation.add_model(single("box", Box((0.3, 0.3, 0.1)), mu=mu), compose(slope, at(z=0.15)))
    simulation.step(500)
    before = box.pose.position

    simulation.step(2000)

    assert math.dist(before, box.pose.position) < 0.001


@pytest.mark.parametrize("mu", [0.3, 0.8])
def test_a_box_slips_above_the_angle_of_friction(mu: float) -> None:
    angle = 1.1 * math.atan(mu)
    slope = tilted(angle)
    simulation = Simulation(World(models=(still("slope", Box((40, 5, 0.2)), slope, mu=100.0),)))
    box = simulation.add_model(single("box", Box((0.3, 0.3, 0.1)), mu=mu), compose(slope, at(z=0.15)))
    simulation.step(500)
    before = math.hypot(*box.state.linear)

    simulation.step(1000)

    expected = G * (math.sin(angle) - mu * math.cos(angle))
    assert math.hypot(*box.state.linear) - before == pytest.approx(expected, abs=0.01 * mu * G)


def energy(simulation: Simulation) -> float:
    """Return the energy of rods with mass 1 kg, from their states."""
    total = 0.0
    for link in simulation.model("pendulum").links.values():
        state = link.state
        length = -2 * link.record.inertial.pose.position[2]
        arm_to_center = rotate(state.pose.orientation, (0.0, 0.0, -length / 2))
        velocity = np.add(state.linear, np.cross(state.angular, arm_to_center))
        height = state.pose.position[2] + arm_to_center[2]
        total += 0.5 * float(velocity @ velocity) + 0.5 * length**2 / 12 * state.angular[1] ** 2 + G * height
    return total


def test_a_double_pendulum_keeps_its_energy_for_a_minute() -> None:
    simulation = Simulation(World(models=(pendulum(2, start=1.2),)))
    lowest = G * (2 * 2 - 0.25 - 0.75)  # both rods hang down
    means: list[float] = []

    for _ in range(60):
        second: list[float] = []
        for _ in range(50):
            simulation.step(20)
            second.append(energy(simulation))
        means.append(sum(second) / len(second))

    # Means, because the velocities belong to half a step before the positions.
    assert max(abs(mean - means[0]) for mean in means) < 0.005 * (means[0] - lowest)


def test_a_stack_of_ten_boxes_stands_for_a_minute() -> None:
    boxes = tuple(single(f"box{i}", Box((0.2, 0.2, 0.2)), pose=at(z=0.1 + 0.2 * i)) for i in range(10))
    simulation = Simulation(World(models=(GROUND, *boxes)))

    assert simulation.step(60_000) == []

    for index in range(10):
        x, y, z = simulation.model(f"box{index}").pose.position
        assert math.hypot(x, y) < 0.002
        assert z == pytest.approx(0.1 + 0.2 * index, abs=0.0004 * (index + 1))


def test_a_diff_drive_robot_drives_the_circle() -> None:
    simulation = Simulation(World(models=(GROUND, diff_drive())))
    robot = simulation.model("robot")
    v, w = 0.2, 0.5
    simulation.step(200)
    robot.joints["left_joint"].set_velocity((v - w * 0.15) / 0.05, 5.0)
    robot.joints["right_joint"].set_velocity((v + w * 0.15) / 0.05, 5.0)
    simulation.step(500)

    points: list[Vector] = []
    for _ in range(126):
        simulation.step(100)
        points.append(robot.pose.position)

    x, y = np.array(points)[:, :2].T
    assert np.ptp(x) / 2 == pytest.approx(v / w, rel=0.01)
    assert np.ptp(y) / 2 == pytest.approx(v / w, rel=0.01)
    state = robot.state
    assert math.hypot(*state.linear[:2]) == pytest.approx(v, rel=0.01)
    assert state.angular[2] == pytest.approx(w, rel=0.01)


def test_a_robot_on_rough_casters_drives_smoothly() -> None:
    robot = diff_drive()
    rough = Surface(0.1, 0.1)
    links = {
        name: replace(link, collisions=(replace(link.collisions[0], surface=rough),))
        if name in ("front", "back")
        else link
        for name, link in robot.links.items()
    }
    simulation = Simulation(World(models=(GROUND, replace(robot, links=links))))
    model = simulation.model("robot")
    for joint in ("left_joint", "right_joint"):
        model.joints[joint].set_velocity(4.0, 5.0)
    simulation.step(1000)

    speeds: list[float] = []
    for _ in range(1000):
        simulation.step()
        speeds.append(model.state.linear[0])

    assert sum(speeds) / 1000 == pytest.approx(0.2, rel=0.005)
    assert max(speeds) - min(speeds) < 0.001


def test_a_robot_with_four_wheels_turns_in_place() -> None:
    """With Coulomb friction, wheels at (+-length/2, +-width/2) turn it by 2 v width / (width^2 + length^2)."""
    length, width, radius = 0.3, 0.33, 0.0625
    simulation = Simulation(World(models=(GROUND, four_wheels(length, width, radius))))
    robot = simulation.model("robot")
    simulation.step(500)
    for index, speed in enumerate((-3.5, -3.5, 3.5, 3.5)):
        robot.joints[f"joint{index}"].set_velocity(speed, 1.7)
    simulation.step(500)
    rates: list[float] = []
    for _ in range(1000):
        simulation.step()
        rates.append(robot.state.angular[2])

    expected = 2 * 3.5 * radius * width / (width**2 + length**2)
    assert sum(rates) / len(rates) == pytest.approx(expected, rel=0.04)
    assert math.hypot(*robot.pose.position[:2]) < 0.01


def test_of_two_frictions_the_smaller_counts() -> None:
    floor = still("floor", Box((20, 20, 0.2)), at(z=-0.1), mu=0.1)
    simulation = Simulation(
        World(models=(floor, single("rough", Box((0.2, 0.2, 0.1)), pose=at(z=0.05), mu=1.0)))
    )
    box = simulation.model("rough")
    simulation.step(100)
    box.set_velocity((2.0, 0.0, 0.0), (0.0, 0.0, 0.0))

    simulation.step(1000)

    assert box.state.linear[0] == pytest.approx(2.0 - 0.1 * G, rel=0.03)


@pytest.mark.parametrize(("mu", "mu2", "expected"), [(1.5, 0.3, 0.3), (0.3, 1.5, 0.3), (0.4, 0.0, 0.2)])
def test_of_two_directions_the_smoother_counts(mu: float, mu2: float, expected: float) -> None:
    link = body("link", Box((0.2, 0.2, 0.1)), surface=Surface(mu, mu2))
    simulation = Simulation(World(models=(GROUND, Model("box", {"link": link}, pose=at(z=0.05)))))
    box = simulation.model("box")
    simulation.step(100)
    box.set_velocity((4.0, 0.0, 0.0), (0.0, 0.0, 0.0))

    simulation.step(500)

    assert box.state.linear[0] == pytest.approx(4.0 - 0.5 * expected * G, rel=0.03)


def grained(mu: float, mu2: float, direction: Vector, pose: Pose = IDENTITY, *, still: bool = False) -> Model:
    """Return a box of which ``mu`` is the friction along a direction of its collision."""
    shape = Box((20, 20, 0.1)) if still else Box((0.3, 0.3, 0.1))
    surface = Surface(mu, mu2, fdir1=direction)
    return Model("box", {"link": body("link", shape, surface=surface)}, pose=pose, is_static=still)


@pytest.mark.parametrize(("direction", "yaw"), [((1, 0, 0), 0.0), ((0, 2, 0), math.pi / 2), ((1, 0, 0), 2.5)])
def test_a_box_slips_along_the_smooth_direction_and_rests_along_the_other(
    direction: Vector, yaw: float
) -> None:
    """The plane is level, and gravity is tilted: along the direction with 0.2, then across it with 0.8."""
    turned = rotate(at(yaw=yaw).orientation, direction)
    along = turned[0] / math.hypot(*turned), turned[1] / math.hypot(*turned)
    pull = 4.0  # m/s^2, of a weight of 9.8: more than 0.2, less than 0.8
    for (x, y), acceleration in ((along, pull - 0.2 * G), ((-along[1], along[0]), 0.0)):
        gravity = (pull * x, pull * y, -G)
        ground = replace(grained(100.0, 100.0, (0, 0, 0), at(z=-0.05), still=True), name="floor")
        box = grained(0.2, 0.8, direction, at(z=0.05, yaw=yaw))
        simulation = Simulation(World(models=(ground, box), physics=Physics(gravity=gravity)))
        simulation.step(500)
        before = simulation.model("box").state.linear

        simulation.step(1000)

        vx, vy, _ = (b - a for a, b in zip(before, simulation.model("box").state.linear, strict=True))
        assert vx * x + vy * y == pytest.approx(acceleration, abs=0.02)
        assert abs(vy * x - vx * y) < 0.01


def test_the_ground_has_two_directions_of_friction_too() -> None:
    """A box with one coefficient slides on a floor that is smooth along y: of each direction, the smaller friction counts."""
    floor = replace(grained(0.9, 0.1, (1, 0, 0), at(z=-0.05), still=True), name="floor")
    simulation = Simulation(
        World(models=(floor, single("box", Box((0.3, 0.3, 0.1)), pose=at(z=0.05), mu=0.5)))
    )
    box = simulation.model("box")
    for velocity, mu in (((3.0, 0.0, 0.0), 0.5), ((0.0, 3.0, 0.0), 0.1)):
        simulation.reset_models()
        simulation.step(100)
        box.set_velocity(velocity, (0.0, 0.0, 0.0))

        simulation.step(300)

        assert math.hypot(*box.state.linear) == pytest.approx(3.0 - 0.3 * mu * G, rel=0.01)


def test_a_direction_of_friction_along_the_normal_is_none() -> None:
    """The smaller coefficient counts, as without a direction. A model of the same name without one follows."""
    for direction in ((0.0, 0.0, 1.0), (0.0, 0.0, 0.0)):
        simulation = Simulation(World(models=(GROUND,)))
        for mu, mu2, chosen in ((0.8, 0.1, (1.0, 0.0, 0.0)), (1.5, 0.3, direction)):
            box = simulation.add_model(grained(mu, mu2, chosen, at(z=0.05)))
            simulation.step(100)
            box.set_velocity((4.0, 0.0, 0.0), (0.0, 0.0, 0.0))
            simulation.step(500)
            speed = box.state.linear[0]
            simulation.remove_model("box")

        assert speed == pytest.approx(4.0 - 0.5 * 0.3 * G, rel=0.03)


def test_a_plane_that_hangs_on_a_wall_ends() -> None:
    poster = still("poster", Plane(size=(1.0, 2.0)), compose(at(x=3.0, z=1.0), tilted(-math.pi / 2)))
    behind = single("behind", Sphere(0.2), pose=at(x=4.0, z=0.2))
    simulation = Simulation(World(models=(GROUND, poster, behind)))

    simulation.step(200)

    assert simulation.model("behind").pose.position == pytest.approx((4.0, 0.0, 0.2), abs=0.002)
    forward = np.array([[1.0, 0.0, 0.0]])
    assert simulation.cast_rays(at(z=1.2), forward, 10.0).distances[0] == pytest.approx(3.0)
    assert math.isinf(simulation.cast_rays(at(y=1.1, z=1.2), forward, 10.0).distances[0])


def test_a_velocity_motor_is_limited_by_its_force() -> None:
    rotor = body("rotor", Box((1.0, 0.1, 0.1)), 2.0)
    inertia = rotor.inertial.inertia[5]
    model = Model("fan", {"rotor": rotor}, {"joint": Joint("joint", "continuous", "world", "rotor")})
    simulation = Simulation(World(models=(model,)))
    joint = simulation.model("fan").joints["joint"]
    joint.set_velocity(10.0, max_force=0.5)

    simulation.step(1000)
    assert joint.velocity == pytest.approx(0.5 / inertia, rel=1e-3)
    assert joint.effort == pytest.approx(0.5, rel=1e-3)

    simulation.step(3000)
    assert joint.velocity == pytest.approx(10.0, rel=1e-3)
    assert joint.effort == pytest.approx(0.0, abs=1e-3)

    joint.stop_motor()
    simulation.step(1000)
    assert joint.velocity == pytest.approx(10.0, rel=1e-3)


def test_position_motors_hold_an_arm_and_follow() -> None:
    simulation = Simulation(World(models=(GROUND, arm(7))))
    joints = [simulation.model("arm").joints[f"joint{i}"] for i in range(7)]
    for joint in joints:
        joint.set_position(0.5)
    simulation.step(1000)
    assert [joint.position for joint in joints] == pytest.approx([0.5] * 7, abs=1e-3)

    worst = 0.0
    for step in range(2000):
        target = 0.5 + 0.3 * math.sin(math.pi * step * 0.001)
        for joint in joints:
            joint.set_position(target)
        simulation.step()
        worst = max(worst, *(abs(joint.position - target) for joint in joints))
    assert worst < 0.002


def test_a_position_motor_moves_with_its_velocity() -> None:
    simulation = Simulation(World(models=(pendulum(start=0.0),)))
    joint = simulation.model("pendulum").joints["joint0"]
    joint.set_position(1.0, max_velocity=0.5)

    simulation.step(1000)
    assert joint.position == pytest.approx(0.5, abs=0.002)
    simulation.step(2000)
    assert joint.position == pytest.approx(1.0, abs=0.001)


def test_limits_stop_a_joint() -> None:
    model = pendulum(start=0.0, axis=Axis(lower=-0.5, upper=0.25))
    joint = Joint("joint0", "revolute", "world", "rod0", axis=model.joints["joint0"].axis)
    simulation = Simulation(World(models=(Model("pendulum", model.links, {"joint0": joint}),)))
    handle = simulation.model("pendulum").joints["joint0"]

    handle.set_force(50.0)
    simulation.step(2000)
    assert handle.position == pytest.approx(0.25, abs=0.01)
    handle.set_force(-50.0)
    simulation.step(2000)
    assert handle.position == pytest.approx(-0.5, abs=0.01)


def test_damping_slows_a_joint() -> None:
    rotor = body("rotor", Box((1.0, 0.1, 0.1)), 2.0)
    axis = Axis(damping=0.1)
    joint = Joint("joint", "continuous", "world", "rotor", axis=axis)
    simulation = Simulation(World(models=(Model("fan", {"rotor": rotor}, {"joint": joint}),)))
    handle = simulation.model("fan").joints["joint"]
    handle.set_state(0.0, 5.0)

    simulation.step(1000)

    assert handle.velocity == pytest.approx(5.0 * math.exp(-0.1 / rotor.inertial.inertia[5]), rel=0.002)


def test_damping_does_not_slow_a_strong_motor() -> None:
    wheel = body("wheel", Cylinder(0.025, 0.01), 0.01)
    joint = Joint("joint", "continuous", "world", "wheel", axis=Axis(damping=1.0))
    simulation = Simulation(World(models=(Model("wheel", {"wheel": wheel}, {"joint": joint}),)))
    handle = simulation.model("wheel").joints["joint"]

    handle.set_velocity(6.0, 500.0)
    simulation.step(5)
    assert handle.velocity == pytest.approx(6.0, abs=0.01)
    assert handle.effort == pytest.approx(6.0, abs=0.01)

    # The damping takes all of a weak motor's force.
    handle.set_velocity(6.0, 3.0)
    simulation.step(100)
    assert handle.velocity == pytest.approx(3.0, rel=0.03)

    handle.set_velocity(0.0, 3.0)
    simulation.step(5)
    assert handle.velocity == pytest.approx(0.0, abs=0.01)

    handle.set_state(0.0, 5.0)
    handle.stop_motor()
    simulation.step(100)
    assert abs(handle.velocity) < 0.01


@pytest.mark.parametrize(
    ("start", "target", "expected"), [(1.9, -1.95, 1.336), (1.9, -1.5, 1.336), (1.0, -1.5, 0.812)]
)
def test_damping_helps_a_motor_that_reverses(start: float, target: float, expected: float) -> None:
    wheel = Link("wheel")  # its inertia is 1 kg m^2
    axis = Joint("axle", "continuous", "world", "wheel", axis=Axis((0, 1, 0), damping=0.5))
    simulation = Simulation(World(models=(Model("model", {"wheel": wheel}, {"axle": axis}),)))
    joint = simulation.model("model").joints["axle"]
    joint.set_state(0.0, start)
    joint.set_velocity(target, 1.0)
    # The motor and the damping brake: dw/dt = -1 - 0.5 w.
    steps = 0
    while joint.velocity > 0 and steps < 2 * expected * 1000:
        simulation.step()
        steps += 1
    assert steps / 1000 == pytest.approx(expected, abs=0.003)


def test_joint_friction_stops_a_joint() -> None:
    rotor = body("rotor", Box((1.0, 0.1, 0.1)), 2.0)
    joint = Joint("joint", "continuous", "world", "rotor", axis=Axis(friction=0.1))
    simulation = Simulation(World(models=(Model("fan", {"rotor": rotor}, {"joint": joint}),)))
    handle = simulation.model("fan").joints["joint"]
    handle.set_state(0.0, 1.0)

    simulation.step(1000)
    assert handle.velocity == pytest.approx(1.0 - 0.1 / rotor.inertial.inertia[5], rel=0.01)
    simulation.step(1000)
    assert handle.velocity == pytest.approx(0.0, abs=1e-4)


def test_a_motor_without_force_leaves_the_friction() -> None:
    rotor = body("rotor", Box((1.0, 0.1, 0.1)), 2.0)
    joint = Joint("joint", "continuous", "world", "rotor", axis=Axis(friction=0.1))
    simulation = Simulation(World(models=(Model("fan", {"rotor": rotor}, {"joint": joint}),)))
    handle = simulation.model("fan").joints["joint"]
    handle.set_velocity(5.0, max_force=0.0)
    simulation.step(100)
    assert handle.velocity == 0.0
    handle.set_position(5.0, max_force=0.0)
    simulation.step(100)
    assert handle.velocity == 0.0


def test_a_gripper_lifts_a_cube_and_holds_it() -> None:
    links = {"palm": body("palm", Box((0.05, 0.15, 0.02)), 1.0, at(z=0.57))}
    joints = {"lift": Joint("lift", "prismatic", "world", "palm", axis=Axis((0, 0, 1), -1.0, 1.0))}
    for name, side in (("left", 1.0), ("right", -1.0)):
        links[name] = body(name, Box((0.02, 0.01, 0.06)), 0.05, at(y=side * 0.045, z=0.515))
        joints[name] = Joint(name, "prismatic", "palm", name, axis=Axis((0, -side, 0), -0.02, 0.05))
    cube = single("cube", Box((0.04, 0.04, 0.04)), 0.1, at(z=0.5))
    table = still("table", Box((0.3, 0.3, 0.02)), at(z=0.47))
    simulation = Simulation(World(models=(table, cube, Model("gripper", links, joints))))
    gripper = simulation.model("gripper")
    gripper.joints["lift"].set_position(0.0, 1000.0, 0.2)
    for name in ("left", "right"):
        gripper.joints[name].set_position(0.05, max_force=5.0, max_velocity=0.1)
    simulation.step(1000)
    gripper.joints["lift"].set_position(0.2, 1000.0, 0.2)

    simulation.step(7000)

    assert simulation.model("cube").pose.position == pytest.approx((0.0, 0.0, 0.7), abs=0.004)
    assert gripper.joints["left"].effort == pytest.approx(5.0, rel=0.01)


def test_a_joint_force_lasts_for_its_duration() -> None:
    rotor = body("rotor", Box((1.0, 0.1, 0.1)), 2.0)
    joint = Joint("joint", "continuous", "world", "rotor")
    simulation = Simulation(World(models=(Model("fan", {"rotor": rotor}, {"joint": joint}),)))
    handle = simulation.model("fan").joints["joint"]
    handle.add_force(0.5, start=0.1, duration=0.2)

    simulation.step(100)
    assert handle.velocity == 0.0
    simulation.step(900)
    assert handle.velocity == pytest.approx(0.5 * 0.2 / rotor.inertial.inertia[5], rel=1e-6)


def test_the_limit_of_effort_reduces_a_force() -> None:
    rotor = body("rotor", Box((1.0, 0.1, 0.1)), 2.0)
    joint = Joint("joint", "continuous", "world", "rotor", axis=Axis(effort=0.5))
    simulation = Simulation(World(models=(Model("fan", {"rotor": rotor}, {"joint": joint}),)))
    handle = simulation.model("fan").joints["joint"]
    handle.set_force(100.0)

    simulation.step(100)

    assert handle.velocity == pytest.approx(0.5 * 0.1 / rotor.inertial.inertia[5], rel=1e-6)
    assert handle.effort == 0.5


def test_a_wrench_lasts_for_its_duration_and_turns_a_body() -> None:
    simulation = Simulation(
        World(models=(single("ball", Sphere(0.1), 2.0),), physics=Physics(gravity=(0, 0, 0)))
    )
    ball = simulation.model("ball")
    link = ball.canonical_link
    link.add_wrench((4.0, 0.0, 0.0), point=(0.0, 0.1, 0.0), duration=0.001)

    simulation.step(10)

    state = ball.state
    inertia = 0.4 * 2.0 * 0.1**2
    assert state.linear[0] == pytest.approx(4.0 * 0.001 / 2.0, rel=1e-3)
    assert state.angular[2] == pytest.approx(-0.1 * 4.0 * 0.001 / inertia, rel=1e-6)

    link.add_wrench((2.0, 0.0, 0.0), duration=-1)
    simulation.step(1000)
    assert ball.state.linear[0] == pytest.approx(0.002 + 1.0, rel=1e-2)
    link.clear_wrenches()
    before = ball.state.linear
    simulation.step(1000)
    assert ball.state.linear == pytest.approx(before, abs=1e-9)


def test_a_link_without_gravity_floats() -> None:
    floating = Model("floating", {"link": Link("link", has_gravity=False)}, pose=at(z=1.0))
    falling = Model("falling", {"link": Link("link")}, pose=at(x=2.0, z=10.0))
    simulation = Simulation(World(models=(floating, falling)))
    simulation.step(1000)
    assert simulation.model("floating").pose.position == pytest.approx((0.0, 0.0, 1.0), abs=1e-9)
    assert simulation.model("falling").pose.position[2] == pytest.approx(10 - G / 2, abs=0.01)

    simulation.model("floating").canonical_link.has_gravity = True
    simulation.model("falling").canonical_link.has_gravity = False
    speed = simulation.model("falling").state.linear[2]
    simulation.step(1000)
    assert simulation.model("floating").state.linear[2] == pytest.approx(-G, rel=1e-6)
    assert simulation.model("falling").state.linear[2] == pytest.approx(speed, rel=1e-6)


def test_velocity_decay_slows_a_body() -> None:
    link = Link("link", linear_damping=0.01, has_gravity=False)
    simulation = Simulation(World(models=(Model("body", {"link": link}),)))
    simulation.model("body").set_velocity((1.0, 0.0, 0.0), (0.0, 0.0, 0.0))

    simulation.step(100)

    assert simulation.model("body").state.linear[0] == pytest.approx(0.99**100, rel=1e-3)


def test_the_step_and_gravity_can_be_changed() -> None:
    simulation = Simulation(World(models=(single("ball", Sphere(0.1), pose=at(z=10.0)), pendulum())))
    simulation.set_physics(Physics(step=0.002, gravity=(1.0, 0.0, 0.0)))
    joint = simulation.model("pendulum").joints["joint0"]
    joint.set_velocity(1.0)

    simulation.step(500)

    assert simulation.time_ns == 1_000_000_000
    assert simulation.model("ball").state.linear == pytest.approx((1.0, 0.0, 0.0), abs=1e-9)
    assert joint.velocity == pytest.approx(1.0, rel=1e-3)


def scene() -> Simulation:
    boxes = tuple(single(f"box{i}", Box((0.2, 0.2, 0.2)), pose=at(x=1.0, z=0.1 + 0.21 * i)) for i in range(4))
    return Simulation(World(models=(GROUND, diff_drive(), arm(3, (-2.0, 0.0, 0.0)), *boxes)))


def drive(simulation: Simulation) -> bytes:
    """Drive through the boxes, add and remove models; return all states."""
    robot = simulation.model("robot")
    for name in ("left_joint", "right_joint"):
        robot.joints[name].set_velocity(10.0, 5.0)
    result: list[float] = []
    for index in range(30):
        simulation.model("arm").joints["joint1"].set_force(5.0 * math.sin(index))
        if index == 10:
            simulation.add_model(single("ball", Sphere(0.1)), at(0.8, 0.05, 1.0))
        if index == 20:
            simulation.remove_model("box2")
        simulation.step(100)
        for model in simulation.models.values():
            for link in model.links.values():
                state = link.state
                result += [*state.pose.position, *state.pose.orientation, *state.linear, *state.angular]
    return np.array(result).tobytes()


def test_the_same_commands_give_the_same_bytes() -> None:
    assert drive(scene()) == drive(scene())


def test_rotation_and_offset_of_a_state_are_kept() -> None:
    simulation = Simulation(World(models=(diff_drive(),), physics=Physics(gravity=(0, 0, 0))))
    state = State(at(1.0, 2.0, 3.0, yaw=0.7), (0.1, 0.2, 0.3), (0.4, 0.5, 0.6))
    robot = simulation.model("robot")
    robot.set_state(state)

    found = robot.state

    for left, right in zip((*found.pose, *found[1:]), (*state.pose, *state[1:]), strict=True):
        assert left == pytest.approx(right, abs=1e-9)


def test_surface_defaults_do_not_matter_for_static_models() -> None:
    """A static model never falls."""
    simulation = Simulation(World(models=(still("shelf", Box((1, 1, 1)), at(z=5.0)),)))
    simulation.step(100)
    assert simulation.model("shelf").pose == at(z=5.0)
    assert Surface().mu == 1.0
