"""Visuals as markers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="the simulation needs mujoco-core")

from minirospy.core.sdf.model import Box, Material, Pose, Visual, World
from minirospy.ros.gazebo_ros.markers import has_moved, marker_of
from minirospy.ros.gazebo_ros.physics import Simulation, State
from tests.ros.simulation.worlds import GROUND, at, single


def test_a_relative_path_of_a_picture_is_a_uri(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    picture = Path("models", "crate", "wood.png")
    visual = Visual("v", Box((1.0, 1.0, 1.0)), material=Material(texture=str(picture)))
    marker = marker_of(visual, "crate::link", 0, Pose())
    assert marker is not None
    assert marker.text == (Path.cwd() / picture).as_uri()


def test_bodies_at_rest_have_not_moved() -> None:
    boxes = [single(f"box{index}", Box((0.2, 0.2, 0.2)), pose=at(z=0.1 + 0.2 * index)) for index in range(5)]
    simulation = Simulation(World(models=(GROUND, *boxes)))
    simulation.step(2000)
    before = simulation.body_poses()
    trembled = False
    for _ in range(30):
        simulation.step(33)
        now = simulation.body_poses()
        trembled |= not (now == before).all()
        assert not has_moved(before, now)
    assert trembled
    simulation.model("box4").set_state(State(at(x=2e-5, z=0.9)))
    assert has_moved(before, simulation.body_poses())


def test_poses_of_other_bodies_have_moved() -> None:
    assert has_moved(np.zeros((0, 7)), np.zeros((1, 7)))
    assert not has_moved(np.zeros((0, 7)), np.zeros((0, 7)))
