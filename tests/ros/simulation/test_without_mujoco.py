"""The programs on a computer without MuJoCo."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.ros.robot_state_publisher.conftest import SECONDS


def test_roslaunch_prints_the_command_that_installs_mujoco(
    master: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "mujoco.py").write_text("raise ImportError('hidden')\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    command = [sys.executable, "-m", "minirospy.ros.roslaunch.commands.roslaunch"]
    words = ["gazebo_ros", "empty_world.launch", "gui:=false", "server_required:=true"]
    done = subprocess.run([*command, *words], capture_output=True, text=True, check=False, timeout=SECONDS)
    lines = [line for line in done.stderr.splitlines() if "the simulation needs MuJoCo" in line]
    assert len(lines) == 1
    assert 'install "minirospy[sim]"' in lines[0]
    assert "exit code 1" in done.stderr
