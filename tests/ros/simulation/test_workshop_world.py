"""The workshop's scanner in the simulation: unmodified nodes show on the virtual board what moves in the simulated room."""

from __future__ import annotations

import math
import runpy

import pytest

pytest.importorskip("mujoco", reason="the simulation needs mujoco-core")

from gazebo_msgs.msg import ModelState
from gazebo_msgs.srv import SetModelState
from geometry_msgs.msg import Point, Pose, Quaternion, Twist
from sensor_msgs.msg import LaserScan

from minirospy import Node
from minirospy.board.board import Board
from minirospy.workspace.packages import Packages
from tests.ros.robot_state_publisher.conftest import SECONDS
from tests.ros.simulation.processes import Start, call, run, until

LEDS = range(2, 8)
WALK = Packages().find("rpi_feros_gazebo") / "scripts" / "walk"
GREEN, YELLOW, RED = [2, 3], [4, 5], [6, 7]


def lit(board: Board) -> list[int]:
    return [led for led in LEDS if board.get(led)]


def wait_for_lit(board: Board, leds: list[int]) -> None:
    """Wait until these LEDs are lit, and no others."""
    edges = board.watch(LEDS, timeout=SECONDS)
    assert lit(board) == leds or any(lit(board) == leds for _ in edges), lit(board)


def test_the_leds_show_how_near_a_person_is(master: str, launch: Start) -> None:
    launch("rpi_feros_gazebo", "workshop.launch", "gui:=false", "walk:=false")

    async def walk_to(node: Node, x: float, y: float) -> None:
        pose = Pose(Point(x, y, 0.0), Quaternion(0.0, 0.0, 0.0, 1.0))
        state = ModelState("person", pose, Twist(), "")
        assert (await call(node, "set_model_state", SetModelState, state)).success

    async def scan(node: Node) -> None:
        seen = await until(node, "/sick_safetyscanners/scan", LaserScan, lambda _: True)
        assert (seen.header.frame_id, len(seen.ranges)) == ("scan", 1651)
        assert math.isclose(seen.angle_increment, 0.0029088794, rel_tol=1e-5)
        assert math.isclose(seen.ranges[825], 4.95, abs_tol=0.03)  # the wall ahead
        assert math.isclose(min(seen.ranges), 1.29, abs_tol=0.03)  # the wall behind, at the edge of the view

    with Board() as board:
        run(scan)
        wait_for_lit(board, GREEN)
        # The person's nearest leg is 0.16 and 0.08 m nearer than the body.
        for x, leds in ((0.4, YELLOW), (0.2, RED), (2.0, GREEN)):
            run(lambda node, x=x: walk_to(node, x, 0.0))
            wait_for_lit(board, leds)


def test_a_person_walks_to_the_scanner_and_back(master: str, launch: Start) -> None:
    launch("rpi_feros_gazebo", "workshop.launch", "gui:=false")
    with Board() as board:
        for leds in (GREEN, YELLOW, RED, YELLOW, GREEN):
            wait_for_lit(board, leds)


def test_a_speed_that_cannot_be_walked_is_one_line() -> None:
    read_speed = runpy.run_path(str(WALK))["read_speed"]
    assert (read_speed(2), read_speed("0.5")) == (2.0, 0.5)
    for bad in (0, -1.0, "fast", math.nan, math.inf, [1.0]):
        with pytest.raises(ValueError, match=r"^~speed must be a number from 0\.01 \(m/s\), not "):
            read_speed(bad)
