"""rosmsg and rossrv: output as in real ROS, and exit statuses."""

from __future__ import annotations

import io
import subprocess
import sys
from collections.abc import Callable, Sequence
from typing import Any

import pytest
from std_msgs.msg import Bool, Empty

from .conftest import own_lines

Start = Callable[[Sequence[str]], "subprocess.Popen[str]"]


def test_show(command: Any) -> None:
    assert command("rosmsg", "show", "std_msgs/Bool") == (0, "bool data\n\n", "")
    assert command("rosmsg", "show", "Bool").out == "[std_msgs/Bool]:\nbool data\n\n"
    assert command("rosmsg", "info", "Bool").out == "[std_msgs/Bool]:\nbool data\n\n"
    assert command("rosmsg", "show", "std_msgs/Empty").out == "\n"
    assert command("rosmsg", "show", "rosgraph_msgs/Log").out.startswith("byte DEBUG=1\nbyte INFO=2\n")
    assert command("rosmsg", "show", "geometry_msgs/PointStamped").out == (
        "std_msgs/Header header\n  uint32 seq\n  time stamp\n  string frame_id\n"
        "geometry_msgs/Point point\n  float64 x\n  float64 y\n  float64 z\n\n"
    )
    raw = command("rosmsg", "show", "-r", "geometry_msgs/PointStamped").out
    assert "Header header\n" in raw


def test_show_services(command: Any) -> None:
    assert command("rossrv", "show", "SetBool").out == (
        "[std_srvs/SetBool]:\nbool data\n---\nbool success\nstring message\n\n"
    )
    assert command("rossrv", "show", "Empty").out == "[roscpp/Empty]:\n---\n\n[std_srvs/Empty]:\n---\n\n"


def test_md5(command: Any) -> None:
    assert command("rosmsg", "md5", "std_msgs/Bool").out == "8b94c1b53db61fb6aed406028ad6332a\n"
    assert command("rosmsg", "md5", "Bool").out == "[std_msgs/Bool]: 8b94c1b53db61fb6aed406028ad6332a\n"
    assert command("rossrv", "md5", "std_srvs/SetBool").out == "09fb03525b03e7ea1fd3992bafd87e16\n"


def test_lists(command: Any) -> None:
    assert "std_msgs/Bool\n" in command("rosmsg", "list").out
    assert command("rosmsg", "package", "std_msgs").out.startswith("std_msgs/Bool\nstd_msgs/Byte\n")
    assert command("rosmsg", "package", "-s", "std_msgs").out.startswith("std_msgs/Bool std_msgs/Byte ")
    assert "std_msgs\n" in command("rosmsg", "packages").out
    assert (
        command("rossrv", "package", "std_srvs").out == "std_srvs/Empty\nstd_srvs/SetBool\nstd_srvs/Trigger\n"
    )
    assert " std_srvs" in command("rossrv", "packages", "-s").out


@pytest.mark.parametrize(
    ("argv", "status", "why"),
    [
        (
            ["rosmsg", "show", "std_msgs/Bol"],
            1,
            "message type [std_msgs/Bol] not found; did you mean std_msgs/Bool",
        ),
        (["rosmsg", "show", "std_msgs"], 1, "it is a package: `rosmsg package std_msgs` lists its types"),
        (["rosmsg", "show", "Bol"], 1, "message type [Bol] not found; did you mean Bool"),
        (["rosmsg", "show", "nope/Nope"], 1, "message type [nope/Nope] not found"),
        (["rossrv", "md5", "SetBol"], 1, "service type [SetBol] not found; did you mean SetBool"),
        (["rosmsg", "package", "std_msg"], 64, "package [std_msg] not found; did you mean std_msgs"),
        (["rosmsg", "show"], 2, "a name is missing"),
    ],
)
def test_what_cannot_be(
    command: Any, argv: list[str], status: int, why: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO())
    result = command(*argv)
    assert (result.status, result.out) == (status, "")
    assert why in result.err
    assert len(own_lines(result.err)) == 1


def test_an_unknown_verb_prints_the_help(command: Any) -> None:
    result = command("rosmsg", "shw")
    assert (result.status, result.out) == (64, command("rosmsg", "-h").out)
    assert "did you mean show" in result.err


def test_help(command: Any) -> None:
    for name in ("rosmsg", "rossrv"):
        for verb in ("show", "info", "list", "md5", "package", "packages"):
            assert f"\t{name} {verb}\t" in command(name, "-h").out
            assert command(name, verb, "-h").status == 0


def test_the_programs(program: Start) -> None:
    assert program(["rosmsg", "show", "std_msgs/Bool"]).communicate(timeout=30) == ("bool data\n\n", "")
    assert program(["rossrv", "show", "std_srvs/Empty"]).communicate(timeout=30) == ("---\n\n", "")


def test_names_from_a_pipe(command: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Tests `rostopic type /t | rosmsg show` and `rosservice type /s | rossrv show`."""
    for words, text, out in (
        (("rosmsg", "show"), "std_msgs/Bool\n", "bool data\n\n"),
        (("rosmsg", "md5"), "std_msgs/Bool\nstd_msgs/Empty\n", f"{Bool._md5sum}\n{Empty._md5sum}\n"),
        (("rossrv", "package", "-s"), "std_srvs\n", "std_srvs/Empty std_srvs/SetBool std_srvs/Trigger\n"),
    ):
        monkeypatch.setattr(sys, "stdin", io.StringIO(text))
        assert command(*words) == (0, out, "")
