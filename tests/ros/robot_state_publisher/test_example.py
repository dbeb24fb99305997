"""docs/robots.md: run its first command, and compare the output with the page."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import free_port
from tests.ros.robot_state_publisher.conftest import SECONDS

PAGE = (Path(__file__).parents[3] / "docs" / "robots.md").read_text(encoding="utf-8")
BIN = Path(sys.executable).parent


def typed(line: str, until: str) -> str:
    """Return a launch's output up to a line; then send Ctrl-C."""
    import signal

    command, *words = line.split()
    port = free_port()
    launch = subprocess.Popen(
        [str(BIN / command), "-p", str(port), *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env={**os.environ, "ROS_MASTER_URI": f"http://localhost:{port}"},
    )
    assert launch.stdout
    read = ""
    for each in launch.stdout:
        read += each
        if re.search(until, each):
            break
    launch.send_signal(signal.SIGINT)
    rest, _ = launch.communicate(timeout=SECONDS)
    assert launch.returncode == 0, read + rest
    assert "Traceback" not in read + rest
    return read


@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C of Unix")
def test_arm_of_the_page_prints_what_the_page_shows() -> None:
    line, *shown = re.findall(r"^    (.*)\n", PAGE.partition("## An arm")[2], re.M)[:5]
    assert line.startswith("$ ")
    assert "\n".join(shown) in typed(line.removeprefix("$ "), "RPY .degree")


@pytest.mark.skipif(sys.platform == "win32", reason="Ctrl-C of Unix")
def test_arguments_of_the_launch_file_reach_the_description() -> None:
    # 0.1 + 0.8 + 0.4 m: the arm points straight up.
    read = typed(
        "roslaunch two_link_arm arm.launch upper_length:=0.8 shoulder:=0.0 elbow:=0.0", "RPY .degree"
    )
    assert "- Translation: [0.000, 0.000, 1.300]" in read
