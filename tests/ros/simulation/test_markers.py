"""Visuals as markers."""

from __future__ import annotations

from pathlib import Path

import pytest

from minirospy.core.sdf.model import Box, Material, Pose, Visual
from minirospy.ros.gazebo_ros.markers import marker_of


def test_a_relative_path_of_a_picture_is_a_uri(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    picture = Path("models", "crate", "wood.png")
    visual = Visual("v", Box((1.0, 1.0, 1.0)), material=Material(texture=str(picture)))
    marker = marker_of(visual, "crate::link", 0, Pose())
    assert marker is not None
    assert marker.text == (Path.cwd() / picture).as_uri()
