"""The command rosconsole, with a node that has loggers."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence

import pytest

from minirospy.ros.rosconsole.commands.rosconsole import _shown

from .conftest import Command, Robot

_NODE = """
import rospy
from std_msgs.msg import Bool
rospy.init_node('talker')
rospy.logdebug('x', logger_name='inner')
publisher = rospy.Publisher('/chat', Bool, queue_size=1)
subscriber = rospy.Subscriber('/button_state', Bool, lambda message: None)
print('ready', flush=True)
while not rospy.is_shutdown():
    line = input()
    rospy.logerr(line) if line.startswith('!') else rospy.loginfo(line)
"""


@pytest.fixture
def talker(master: str) -> Iterator[subprocess.Popen[str]]:
    """Run the node /talker, which logs the lines from stdin; a line that starts with an exclamation mark is an error."""
    process = subprocess.Popen(
        [sys.executable, "-c", _NODE],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=dict(os.environ),
    )  # fmt: skip
    assert process.stdout
    assert process.stdout.readline() == "ready\n"
    yield process
    process.kill()
    process.communicate()


def test_levels(talker: subprocess.Popen[str], command: Command) -> None:
    loggers = command("rosconsole", "list", "talker").out.splitlines()
    assert {"rosout", "rosout.inner"} <= set(loggers)
    assert command("rosconsole", "get", "/talker", "rosout") == (0, "INFO\n", "")
    assert command("rosconsole", "set", "talker", "rosout", "WARN") == (0, "", "")
    assert command("rosconsole", "get", "talker", "rosout") == (0, "WARN\n", "")


def test_what_is_not_there(talker: subprocess.Popen[str], command: Command) -> None:
    for verb, *level in (["get"], ["set", "debug"]):
        status, _, err = command("rosconsole", verb, "talker", "rosuot", *level)
        assert status == 1
        assert err.startswith(
            "rosconsole: ERROR: logger of node /talker [rosuot] not found; did you mean rosout"
        )
        assert err.count("\n") == 1
    assert command("rosconsole", "list", "taker").err == (
        "rosconsole: ERROR: node [/taker] not found; did you mean /talker?\n"
    )
    status, _, err = command("rosconsole", "set", "talker", "rosout", "loud")
    assert status == 2
    assert "choose from" in err
    assert command("rosconsole", "echo", "(").status == 2


def test_a_node_without_loggers(robot: Robot, command: Command) -> None:
    assert command("rosconsole", "list", "robot").err == (
        "rosconsole: ERROR: node [/robot] does not report its loggers: it has no service get_loggers\n"
    )


def test_without_a_master(command: Command) -> None:
    for words in (["list", "n"], ["echo"]):
        status, out, err = command("rosconsole", *words)
        assert (status, out) == (1, "")
        assert "no ROS master answers" in err


def test_echo_reports_that_it_receives_nothing(
    master: str, program: Callable[[Sequence[str]], subprocess.Popen[str]]
) -> None:
    echo = program(["rosconsole", "echo", "--topic", "!!", "nobody"])
    assert echo.stderr
    assert [echo.stderr.readline() for _ in range(2)] == [
        "WARNING: topic [/!!] does not appear to be published yet; that is not a legal name: letters, digits, "
        "_ and /\n",
        "WARNING: no node's name starts with [nobody] yet\n",
    ]


def test_echo(
    talker: subprocess.Popen[str], program: Callable[[Sequence[str]], subprocess.Popen[str]]
) -> None:
    words = ["rosconsole", "echo", "--nocolor", "-1"]
    echoes = [program(words), program([*words, "/other"]), program([*words, "-l", "info", "/talk"])]
    assert talker.stdin

    # Repeat this until both are subscribed; they do not receive earlier log messages.
    while any(echo.poll() is None for echo in (echoes[0], echoes[2])):
        talker.stdin.write("quiet\n!loud\n")
        talker.stdin.flush()

        for echo in (echoes[0], echoes[2]):
            try:
                echo.wait(0.2)
            except subprocess.TimeoutExpired:
                break

    assert echoes[0].stdout
    assert echoes[2].stdout
    assert echoes[0].stdout.read() == "[ ERROR ] [\033[1m/talker\033[21m]: !loud\n"
    assert echoes[2].stdout.read() in {
        "[ INFO  ] [\033[1m/talker\033[21m]: quiet\n",
        "[ ERROR ] [\033[1m/talker\033[21m]: !loud\n",
    }
    assert echoes[1].poll() is None


@pytest.mark.skipif(sys.platform == "win32", reason="no tzset")
def test_a_line_as_ros_shows_it(monkeypatch: pytest.MonkeyPatch) -> None:
    from genpy import Time
    from rosgraph_msgs.msg import Log

    log = Log(level=4, name="/me", msg="hello", file="f.py", function="fun", line=12)
    log.header.stamp = Time(1795257716, 2253000)
    assert _shown(log, colour=True, verbose=False) == "[ \033[93mWARN \033[0m ] [\033[1m/me\033[21m]: hello"
    monkeypatch.setenv("TZ", "CET-1")
    time.tzset()
    try:
        assert _shown(log, colour=False, verbose=True) == (
            "[ WARN  ] [\033[1m/me\033[21m]: hello\n"
            "          [2026-11-21 11:41:56.002253+01:00 (1795257716.002253)] [fun]: f.py:12"
        )
    finally:
        monkeypatch.delenv("TZ")
        time.tzset()
