"""Worlds with long steps: the engine divides them, and everything else keeps the world's step."""

from __future__ import annotations

import math
import struct

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="the simulation needs mujoco-core")

from minirospy.core.sdf.model import Box, Model, Physics, Sphere, World
from minirospy.ros.gazebo_ros.loop import SimulationLoop
from minirospy.ros.gazebo_ros.physics import Simulation
from tests.ros.simulation.worlds import GROUND, arm, at, diff_drive, four_wheels, pendulum, single

SMALL = four_wheels()
LARGE = four_wheels(0.512, 0.57, 0.165, 40.0)
G = 9.8


def at_step(step: float, *models: Model, seed: int = 0) -> Simulation:
    return Simulation(World(models=models, physics=Physics(step=step)), seed=seed)


def drive(step: float, robot: Model, left: float, right: float, torque: float) -> tuple[float, float]:
    """Return the mean turn (rad/s) and speed (m/s) of a robot whose wheels turn with the given velocities."""
    simulation = at_step(step, GROUND, robot)
    model = simulation.model("robot")
    simulation.step(round(0.5 / step))
    for index, velocity in enumerate((left, left, right, right)):
        model.joints[f"joint{index}"].set_velocity(velocity, torque)
    simulation.step(round(0.5 / step))
    states = []
    for _ in range(round(2.0 / step)):
        simulation.step()
        states.append(model.state)
    turn = sum(state.angular[2] for state in states) / len(states)
    return turn, sum(math.hypot(*state.linear[:2]) for state in states) / len(states)


@pytest.mark.parametrize("step", [0.004, 0.005, 0.01, 0.02])
@pytest.mark.parametrize(
    ("robot", "left", "right", "torque"),
    [(SMALL, 2.0, 6.0, 5.0), (SMALL, -3.5, 3.5, 5.0), (LARGE, 2.0, 4.0, 60.0), (LARGE, -1.5, 1.5, 60.0)],
)
def test_a_skidding_robot_turns_as_fast_as_with_one_millisecond(
    step: float, robot: Model, left: float, right: float, torque: float
) -> None:
    turn, speed = drive(step, robot, left, right, torque)
    expected_turn, expected_speed = drive(0.001, robot, left, right, torque)
    assert turn == pytest.approx(expected_turn, rel=0.005)
    assert speed == pytest.approx(expected_speed, rel=0.005, abs=1e-3)


@pytest.mark.parametrize(
    ("step", "count"), [(1e-9, 1), (0.001, 1), (0.0025, 1), (0.0026, 2), (0.01, 4), (1.0, 400)]
)
def test_a_step_has_as_many_substeps_as_contacts_need(step: float, count: int) -> None:
    simulation = at_step(step, single("box", Box((0.2, 0.2, 0.2))))
    assert simulation.engine.substeps == count
    simulation.step()
    assert simulation.time_ns == round(step * 1e9)
    assert simulation.model("box").state.linear[2] == pytest.approx(-G * step, rel=1e-6)


def test_the_step_can_be_changed() -> None:
    simulation = at_step(0.001, GROUND, SMALL)
    simulation.set_physics(simulation.physics._replace(step=0.01))
    model = simulation.model("robot")
    for index, velocity in enumerate((2.0, 2.0, 6.0, 6.0)):
        model.joints[f"joint{index}"].set_velocity(velocity, 5.0)
    simulation.step(100)
    simulation.add_model(single("late", Sphere(0.1)), at(x=5.0, z=0.1))  # it compiles the world again
    rates = []
    for _ in range(200):
        simulation.step()
        rates.append(model.state.angular[2])
    assert simulation.time_ns == 3_000_000_000
    assert sum(rates) / 200 == pytest.approx(drive(0.001, SMALL, 2.0, 6.0, 5.0)[0], rel=0.01)


def test_a_falling_box_lands_as_with_one_millisecond() -> None:
    depths = {}
    for step in (0.001, 0.01):
        simulation = at_step(step, GROUND, single("box", Box((0.2, 0.2, 0.2)), pose=at(z=1.0)))
        box = simulation.model("box")
        heights = []
        for _ in range(round(2.0 / step)):
            simulation.step()
            heights.append(box.pose.position[2])
        assert heights[-1] == pytest.approx(0.1, abs=3e-4)
        depths[step] = 0.1 - min(heights)
    assert depths[0.01] < 1.5 * depths[0.001]


def test_a_push_acts_for_one_step_of_the_world() -> None:
    simulation = at_step(0.01, single("ball", Sphere(0.1), 2.0))
    ball = simulation.model("ball")
    ball.canonical_link.push((3.0, 0.0, 0.0))
    simulation.step()
    assert ball.state.linear[0] == pytest.approx(3.0 / 2.0 * 0.01)
    simulation.step(10)
    assert ball.state.linear[0] == pytest.approx(3.0 / 2.0 * 0.01)


def test_a_wrench_acts_for_its_duration() -> None:
    simulation = at_step(0.01, single("ball", Sphere(0.1), 2.0))
    ball = simulation.model("ball")
    ball.canonical_link.add_wrench((3.0, 0.0, 0.0), start=0.1, duration=0.2)
    simulation.step(50)
    assert ball.state.linear[0] == pytest.approx(3.0 / 2.0 * 0.2)


def test_a_position_motor_moves_steadily_within_a_step() -> None:
    """The motor reaches a target at the end of the world's step, not in the first substep."""
    simulation = at_step(0.01, pendulum(start=0.0))
    joint = simulation.model("pendulum").joints["joint0"]
    joint.set_position(1.0, max_velocity=0.5)
    simulation.step(100)
    assert joint.position == pytest.approx(0.5, abs=0.01)
    for step in range(100):
        joint.set_position(0.5 + 0.005 * step)
        simulation.step()
        if step > 10:
            assert joint.velocity == pytest.approx(0.5, rel=0.02)


def test_the_same_seed_gives_the_same_bytes() -> None:
    def states() -> bytes:
        simulation = at_step(0.01, GROUND, SMALL, arm(3, (2.0, 0.0, 0.0)), seed=3)
        robot = simulation.model("robot")
        result = b""
        for step in range(100):
            if step == 10:
                for index, velocity in enumerate((2.0, 2.0, 6.0, 6.0)):
                    robot.joints[f"joint{index}"].set_velocity(velocity, 5.0)
                simulation.model("arm").joints["joint1"].set_force(3.0)
            simulation.step()
            data = simulation.engine.data
            noise = simulation.random.normal()
            result += data.qpos.tobytes() + data.qvel.tobytes() + struct.pack("<d", noise)
        return result

    assert states() == states()


def test_a_model_that_explodes_within_a_step_leaves_the_others_on_their_way() -> None:
    simulation = at_step(0.01, GROUND, single("ball", Sphere(0.1), pose=at(z=5.0)))
    simulation.add_model(single("bomb", Sphere(0.1)), at(x=5.0, z=1.0))
    simulation.step(10)
    simulation.model("bomb").canonical_link.push((1e12, 0.0, 0.0))

    lost = simulation.step(10)

    assert [each.name for each in lost] == ["bomb"]
    assert simulation.time_ns == 200_000_000
    # One substep of 2.5 ms is lost.
    assert simulation.model("ball").state.linear[2] == pytest.approx(-G * 0.1975, rel=1e-3)


def test_contacts_are_those_of_the_last_substep() -> None:
    simulation = at_step(0.01, GROUND, single("box", Box((0.2, 0.2, 0.2)), 2.0, at(z=0.1)))
    simulation.records_details = True
    simulation.step(50)
    (contact,) = simulation.contacts()
    assert abs(sum(wrench.force[2] for wrench in contact.wrenches)) == pytest.approx(2.0 * G, rel=1e-3)


def test_plugins_run_once_in_a_step_of_the_world() -> None:
    simulation = at_step(0.01, GROUND, diff_drive())
    loop = SimulationLoop(simulation, paused=True)
    times: list[int] = []
    loop.before_step = lambda: times.append(simulation.time_ns)
    loop.step(20)  # the loop's thread has not been started
    assert times == np.arange(0, 200_000_000, 10_000_000).tolist()
