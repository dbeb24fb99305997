"""The workshop's first evening and later pages on Windows' CPython under Wine, with real ROS nodes on the other side."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import write_files
from tests.interop.conftest import REAL_BIN, REAL_PYTHON, running_master, stop
from tests.interop.conftest import start as start_on_linux
from tests.windows.programs import SECONDS, TALKER, WINDOWS, Start, command

TESTS = Path(__file__).parents[1]
LISTINGS = TESTS / "workshop"
PEER = TESTS / "interop" / "peer.py"

CANCEL = """
import threading
import rospy
from actionlib_msgs.msg import GoalID
from rpi_msgs.msg import runningLedActionResult
rospy.init_node("cancel", argv=[])
is_over = threading.Event()
rospy.Subscriber("run_led/result", runningLedActionResult, lambda message: is_over.set())
cancel = rospy.Publisher("run_led/cancel", GoalID, queue_size=1)
print("ready", flush=True)
while not is_over.wait(0.5):
    cancel.publish(GoalID())
"""
"""Cancels all goals repeatedly until a result arrives."""


@pytest.fixture
def typed(environ: dict[str, str], place: Path) -> Typed:
    return Typed(environ, place)


class Typed:
    """Runs commands as a student does in a second terminal, and returns their output."""

    def __init__(self, environ: dict[str, str], folder: Path) -> None:
        self._environ = environ
        self._folder = folder

    def __call__(self, name: str, *words: str) -> str:
        status, said = WINDOWS.run(command(name), *words, folder=self._folder, environ=self._environ)
        assert status == 0, said
        return said

    def wait_for_led(self, pin: int, level: int) -> None:
        """Wait until an LED on the board has this level."""
        while self("minirospy", "board", "get", str(pin)) != f"{level}\n":
            pass


def listing(name: str) -> str:
    """Return the path of a workshop program, as printed in the course."""
    return WINDOWS.path(LISTINGS / name)


def test_first_node_of_the_workshop(start: Start) -> None:
    start(command("roscore")).until("started core service")
    node = start(listing("my_first_node.py"))
    said = node.rest()
    assert node.process.wait(SECONDS) == 0, said
    assert "This node has been started." in said
    assert said.splitlines()[-1] == "Exit now"


def test_led_follows_the_button_by_topic(start: Start, typed: Typed) -> None:
    start(command("roscore")).until("started core service")
    start(listing("button_publisher.py"))
    start(listing("led_actuator.py"))
    for level, verb in ((1, "press"), (0, "release")):
        typed("minirospy", "board", verb, "11")
        typed.wait_for_led(7, level)
    assert "Publishers: \n * /button_state_publisher_" in typed("rostopic", "info", "/button_state")
    assert "Subscriptions: \n * /button_state [std_msgs/Bool]" in typed("rosnode", "info", "/led_actuator")


def test_each_press_calls_the_service(start: Start, typed: Typed) -> None:
    start(command("roscore")).until("started core service")
    start(listing("led_service_server.py"))
    while "/set_led_state" not in typed("rosservice", "list"):
        pass
    client = start(listing("button_service_client.py"))
    while "/button_monitor" not in typed("rosnode", "list"):
        pass
    # It starts to watch the button shortly after it has registered, and ignores presses that follow within half a
    # second.
    while "Successfully changed LED state." not in client.available():
        typed("minirospy", "board", "press", "11")
        typed("minirospy", "board", "release", "11")
    assert "success: True" in typed("rosservice", "call", "/set_led_state", "data: True")
    typed.wait_for_led(2, 1)


def test_action_runs_the_leds_until_it_is_cancelled(start: Start, typed: Typed) -> None:
    start(command("roscore")).until("started core service")
    server = start(listing("ledrun_server.py"))
    server.until("Server pripravljen")
    canceller = start("-c", CANCEL)
    canceller.until("ready")
    client = start(listing("ledrun_client.py"))
    assert re.search(r"^Result: \d+$", client.rest(), re.MULTILINE)
    assert client.process.wait(SECONDS) == 0
    canceller.rest()
    server.until("Stevilo iteracij: 10", "Goal preempted.")


def test_launch_file_of_the_workshop_lights_the_led(start: Start, typed: Typed) -> None:
    run = start(command("roslaunch"), "rpi_feros_bringup", "rpi_led.launch")
    run.until("process[btn_pub-2]", "process[led_act-3]")
    for level, verb in ((1, "press"), (0, "release")):
        typed("minirospy", "board", verb, "11")
        typed.wait_for_led(7, level)


def test_recorded_messages_are_played(start: Start, place: Path, typed: Typed) -> None:
    write_files(place, {"talker.py": TALKER})
    start(command("roscore")).until("started core service")
    talker = start("talker.py", "_place:=Windows")
    typed("rosbag", "record", "-l", "5", "-O", "Größe.bag", "/words")
    talker.close()

    echo = start(command("rostopic"), "echo", "-n3", "/words")
    player = start(command("rosbag"), "play", "-l", "--wait-for-subscribers", "Größe.bag")
    assert echo.until("aus Windows").count("data:") >= 1
    echo.rest()
    assert echo.process.wait(SECONDS) == 0
    player.close()


@pytest.mark.skipif(not (REAL_BIN / "rosmaster").exists(), reason="real ROS 1 is not installed: make interop")
@pytest.mark.parametrize("direction", ["from Windows", "to Windows"])
def test_nodes_of_real_ros_and_windows(direction: str, place: Path, environ: dict[str, str]) -> None:
    """The master is rosmaster.

    Four types, one of them a 6 MB image, and a service are used; the bytes on both sides are equal.
    """
    with running_master("rospy") as uri:
        here = {**environ, "ROS_MASTER_URI": uri}

        def on_windows(role: str) -> subprocess.Popen[bytes]:
            return WINDOWS.popen(WINDOWS.path(PEER), role, folder=place, environ=here, has_input=True)

        def on_ros(role: str) -> subprocess.Popen[str]:
            return start_on_linux([REAL_PYTHON, str(PEER), role], uri, "rospy", stderr=subprocess.STDOUT)

        for offering, using in (("talk", "listen"), ("serve", "call")):
            first: subprocess.Popen[Any]
            second: subprocess.Popen[Any]
            first = on_windows(offering) if direction == "from Windows" else on_ros(offering)
            try:
                offered = _lines_until_ready(first)
                second = on_ros(using) if direction == "from Windows" else on_windows(using)
                try:
                    printed = _text(second.communicate(timeout=SECONDS)[0])
                finally:
                    stop(second)
            finally:
                stop(first)

            if using == "listen":
                kinds = [
                    line for line in printed if line.partition(" ")[0] in {"bool", "string", "scan", "image"}
                ]
                assert len(offered) == 4
                assert sorted(kinds) == sorted(offered), printed
            else:
                answers = [line for line in printed if "flag:" in line]
                assert answers == ["True flag: True", "False flag: False"] * 2, printed


def _lines_until_ready(process: subprocess.Popen[Any]) -> list[str]:
    assert process.stdout
    found: list[str] = []
    for line in process.stdout:
        found += _text(line)
        if found[-1] == "ready":
            return found[:-1]
    pytest.fail(f"it ended before it was ready: {found}")


def _text(printed: str | bytes) -> list[str]:
    return (printed.decode("cp1252", "replace") if isinstance(printed, bytes) else printed).splitlines()
