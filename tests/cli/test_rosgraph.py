"""The commands rosgraph and rosmaster, whose graph is empty."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Callable, Sequence

import pytest

from .conftest import Command, Robot

_ROBOT = """

Nodes:
  /robot :
    Inbound:
    Outbound:
Services:
  /fail
  /set_led_state
"""


def test_a_round(robot: Robot, command: Command) -> None:
    assert command("rosgraph", "--once") == (0, _ROBOT, "")


def test_it_goes_on_until_ctrl_c(
    robot: Robot, program: Callable[[Sequence[str]], subprocess.Popen[str]]
) -> None:
    process = program(["rosgraph"])
    assert process.stdout
    rounds = 0
    for line in process.stdout:
        rounds += line == "Nodes:\n"
        if rounds == 2:
            break
    if sys.platform != "win32":
        process.send_signal(signal.SIGINT)
        assert process.wait(30) == 0


def test_an_empty_graph(master: str, command: Command) -> None:
    assert command("rosgraph", "-1") == (0, "empty\n", "")


def test_without_a_master(command: Command) -> None:
    status, out, err = command("rosgraph")
    assert (status, out, err) == (0, "", "ERROR: Unable to communicate with master!\n")
    assert command("rosgraph", "more").status == 255


def test_rosmaster_has_no_rosout(
    program: Callable[[Sequence[str]], subprocess.Popen[str]],
    command: Command,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    process = program(["rosmaster", "--core", "-p", "0"])
    assert process.stdout
    for line in process.stdout:
        if line.startswith("ROS_MASTER_URI="):
            monkeypatch.setenv("ROS_MASTER_URI", line.strip().partition("=")[2])
            break
    assert command("rosgraph", "-1") == (0, "empty\n", "")
