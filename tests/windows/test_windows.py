"""Windows' CPython under Wine: commands, nodes on both sides, launch files, workspaces, and killed launchers."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import write_files
from tests.windows.programs import (
    ESCAPED,
    MANIFEST,
    SECONDS,
    TALKER,
    WAIT,
    WINDOWS,
    Start,
    command,
    no_process_left,
)


def test_demo(environ: dict[str, str], place: Path) -> None:
    status, said = WINDOWS.run(command("minirospy"), "demo", "--presses=2", folder=place, environ=environ)
    assert status == 0, said
    assert "2: button 1 released -> LED on GPIO 7 off" in said
    no_process_left()


def test_first_evening_of_the_course(start: Start, environ: dict[str, str], place: Path) -> None:
    """Run a master, a node of the workshop, and the commands for topics, services and parameters."""

    def run(name: str, *words: str) -> str:
        status, said = WINDOWS.run(command(name), *words, folder=place, environ=environ)
        assert status == 0, said
        return said

    start(command("roscore")).until("started core service")
    server = start(command("rosrun"), "rpi_feros", "led_service_server.py")
    while "/set_led_state" not in run("rosservice", "list"):
        assert server.process.poll() is None
    assert "success: True" in run("rosservice", "call", "/set_led_state", "data: True")
    assert run("minirospy", "board", "get", "2") == "1\n"
    server.close()

    # Start a node with the same name.
    start(command("rosrun"), "rpi_feros", "led_actuator.py")
    while "/button_state" not in run("rostopic", "list"):
        pass
    run("rostopic", "pub", "-1", "/button_state", "std_msgs/Bool", "data: True")
    assert run("minirospy", "board", "get", "7") == "1\n"
    assert "Type: std_msgs/Bool" in run("rostopic", "info", "/button_state")
    assert run("rosmsg", "show", "std_msgs/Bool") == "bool data\n\n"
    run("rosparam", "set", "/rate", "2")
    assert run("rosparam", "get", "/rate") == "2\n"


def test_nodes_of_linux_and_windows_exchange_messages(
    start: Start, environ: dict[str, str], place: Path, master: str
) -> None:
    """The master runs on Linux. Messages are sent in both directions; the string has an umlaut."""
    write_files(place, {"talker.py": TALKER})
    linux = {**os.environ, "ROS_MASTER_URI": master, "PYTHONUTF8": "1"}
    with subprocess.Popen([sys.executable, "talker.py", "_place:=Linux"], cwd=place, env=linux) as talker:
        try:
            heard = start(command("rostopic"), "echo", "-n1", "/words", ROS_MASTER_URI=master)
            assert rf'data: "{ESCAPED} aus Linux"' in heard.until("aus Linux")
        finally:
            talker.terminate()

    there = start("talker.py", "_place:=Windows", ROS_MASTER_URI=master)
    echo = [str(Path(sys.executable).with_name("rostopic")), "echo", "-n1", "/words"]
    said = subprocess.run(echo, env=linux, capture_output=True, timeout=SECONDS, check=True).stdout.decode()
    assert rf'data: "{ESCAPED} aus Windows"' in said
    assert there.process.poll() is None


def test_launch_file_with_line_ends_of_windows(start: Start, place: Path, environ: dict[str, str]) -> None:
    """All files have CRLF line ends; one node respawns, and another one is required."""
    stop = (
        "import sys, rospy\nrospy.init_node('x', anonymous=True)\nprint('stopped', flush=True)\nsys.exit(4)\n"
    )
    launch = (
        '<launch>\n<node pkg="pkg" type="wait.py" name="a" output="screen"/>\n'
        '<node pkg="pkg" type="stop.py" name="b" respawn="true" output="screen"/>\n</launch>\n'
    )
    required = '<launch><node pkg="pkg" type="stop.py" name="b" required="true"/></launch>\n'
    files = {
        "package.xml": MANIFEST,
        "a.launch": launch,
        "r.launch": required,
        "wait.py": WAIT,
        "stop.py": stop,
    }
    write_files(place / "pkg", {name: text.replace("\n", "\r\n") for name, text in files.items()})
    run = start(command("roslaunch"), "pkg", "a.launch")
    said = run.until("waiting", "process[a-2]", "[b-3] restarting process")
    # The code page of the output contains umlauts, but no arrows.
    assert "waiting: Größe" in said
    assert r"Größe \u2192 1" in said
    run.close()
    no_process_left()

    status, said = WINDOWS.run(command("roslaunch"), "pkg", "r.launch", folder=place, environ=environ)
    assert status == 1, said
    assert "REQUIRED process [b-2] has died!" in said


def test_workspace(place: Path, environ: dict[str, str]) -> None:
    """Build a workspace, and use it through setup.bat."""
    package = place / "ws" / "src" / "pkg"
    lists = "cmake_minimum_required(VERSION 3.0)\nproject(pkg)\nfind_package(catkin REQUIRED message_generation)\n"
    lists += "add_message_files(FILES Led.msg)\ngenerate_messages()\ncatkin_package()\n"
    files = {
        "package.xml": MANIFEST,
        "CMakeLists.txt": lists,
        "msg/Led.msg": "int64 number\n",
        "scripts/wait.py": WAIT,
    }
    write_files(package, {name: text.replace("\n", "\r\n") for name, text in files.items()})
    status, said = WINDOWS.run(command("catkin_make"), folder=place / "ws", environ=environ)
    assert status == 0, said

    script = "@call devel\\setup.bat\n@rospack find pkg\n@rosmsg show Led\n@echo %ROS_DISTRO%\n"
    (place / "ws" / "try.bat").write_bytes(script.replace("\n", "\r\n").encode())
    status, said = WINDOWS.run("cmd", "/c", "try.bat", folder=place / "ws", environ=environ)
    assert said.splitlines() == [WINDOWS.path(package), "[pkg/Led]:", "int64 number", "", "noetic"]


def test_bag(start: Start, place: Path, environ: dict[str, str]) -> None:
    write_files(place, {"talker.py": TALKER})
    start(command("roscore")).until("started core service")
    start("talker.py")
    for words in (["record", "-l", "3", "-O", "Größe.bag", "/words"], ["info", "Größe.bag"]):
        status, said = WINDOWS.run(command("rosbag"), *words, folder=place, environ=environ)
        assert status == 0, said
    assert "3 msgs" in said
    assert "std_msgs/String" in said


@pytest.mark.parametrize("launcher", ["roslaunch", "rosrun", "minirospy"])
def test_nothing_outlives_a_launcher_that_is_ended_by_force(launcher: str, start: Start, place: Path) -> None:
    """The launcher is killed at different moments, including during its start, and also when run as its command's .exe."""
    write_files(
        place / "pkg",
        {
            "package.xml": MANIFEST,
            "wait.py": WAIT,
            "a.launch": '<launch><node pkg="pkg" type="wait.py" name="a" output="screen"/></launch>',
        },
    )
    words, moments = {
        "roslaunch": (["pkg", "a.launch"], ["SUMMARY", "process[master]", "process[a-2]", "waiting"]),
        "rosrun": (["pkg", "wait.py", "__master:=http://localhost:1"], ["Unable"]),
        "minirospy": (["demo"], ["Starting", "pressed"]),
    }[launcher]
    for moment in moments:
        # A board with a name outlives the process that started it, but the demo's own board must not.
        run = start(command(launcher), *words, MINIROSPY_BOARD="")
        run.until(moment)
        run.close()
        no_process_left()
