"""Windows' CPython under Wine: commands, nodes on both sides, launch files, workspaces, and what is left of a killed launcher.

`make windows` sets the environment up; without it these tests are skipped.
"""

from __future__ import annotations

import os
import queue
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.conftest import free_port, write_files
from tests.windows.windows import Windows

WINDOWS = Windows()
pytestmark = [
    pytest.mark.skipif(not WINDOWS.is_ready, reason="`make windows` sets it up"),
    pytest.mark.timeout(900),
]

SECONDS = 240.0
"""A process takes seconds to start under Wine, several times as many on a busy machine."""

MANIFEST = """<package><name>pkg</name><version>1.0.0</version><description>d</description>
<maintainer email="a@b.c">m</maintainer><license>BSD</license></package>"""

TALKER = """#!/usr/bin/env python
import rospy
from std_msgs.msg import String
rospy.init_node("talker")
publisher = rospy.Publisher("/words", String, queue_size=10)
while not rospy.is_shutdown():
    publisher.publish("Größe aus {}".format(rospy.get_param("~place", "nowhere")))
    rospy.sleep(0.05)
"""

ESCAPED = r"Gr\xF6\xDFe"
"""As rostopic prints it, in YAML."""

WAIT = """#!/usr/bin/env python
import rospy
rospy.init_node("wait")
rospy.loginfo("Größe → 1")
print("waiting: Größe", flush=True)
rospy.spin()
"""


class Run:
    """A program of Windows that runs; what it prints is read as it comes."""

    def __init__(self, process: subprocess.Popen[bytes]) -> None:
        self.process = process
        self.said = ""
        self._lines: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def until(self, *words: str) -> str:
        """Read until all words were printed; return what was printed so far."""
        end = time.monotonic() + SECONDS
        while not all(word in self.said for word in words):
            try:
                line = self._lines.get(timeout=max(0.0, end - time.monotonic()))
            except queue.Empty:
                pytest.fail(f"{words} were not printed, but:\n{self.said}")
            if not line:
                pytest.fail(f"it ended before it printed {words}:\n{self.said}")
            self.said += line
        return self.said

    def rest(self) -> str:
        """Return what a program that has ended has printed."""
        self._reader.join()
        while line := self._lines.get():
            self.said += line
        return self.said

    def close(self) -> None:
        """End it by force."""
        self.process.kill()
        self.process.wait()
        # Closed by the last that has it: what a launcher has started, too.
        self._reader.join()
        assert self.process.stdout
        self.process.stdout.close()

    def _read(self) -> None:
        assert self.process.stdout
        for line in self.process.stdout:
            self._lines.put(line.decode("cp1252", "replace").replace("\r\n", "\n"))
        self._lines.put("")


Start = Callable[..., Run]


@pytest.fixture(autouse=True, scope="module")
def _wine_server() -> Iterator[None]:
    WINDOWS.start_server()
    yield
    WINDOWS.stop_server()


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """Return a folder whose name has a space and an umlaut."""
    folder = tmp_path / "Übung eins"
    folder.mkdir()
    return folder


@pytest.fixture
def environ(place: Path) -> dict[str, str]:
    return {
        "ROS_MASTER_URI": f"http://localhost:{free_port()}",
        "ROS_HOME": WINDOWS.path(place / "home"),
        "ROS_PACKAGE_PATH": WINDOWS.path(place),
        "MINIROSPY_BOARD": place.parent.name,
        "MINIROSPY_LOCAL": "1",
        "PYTHONUNBUFFERED": "1",
    }


@pytest.fixture
def start(place: Path, environ: dict[str, str]) -> Iterator[Start]:
    """Return a function that starts a command of Windows; in the end all are ended by force, and no process is left."""
    runs: list[Run] = []

    def start(*words: str, **more: str) -> Run:
        runs.append(Run(WINDOWS.popen(*words, folder=place, environ={**environ, **more})))
        return runs[-1]

    yield start
    for run in runs:
        run.close()
    no_process_left()


def no_process_left() -> None:
    """Wait until no Python of Windows runs any more."""
    end = time.monotonic() + SECONDS
    while left := WINDOWS.processes():
        assert time.monotonic() < end, [Path(f"/proc/{pid}/cmdline").read_bytes() for pid in left]
        time.sleep(0.2)


def command(name: str) -> str:
    """Return the file of a command, as pip for Windows made it."""
    return rf"C:\Python312\Scripts\{name}.exe"


def test_demo(environ: dict[str, str], place: Path) -> None:
    status, said = WINDOWS.run(command("minirospy"), "demo", "--presses=2", folder=place, environ=environ)
    assert status == 0, said
    assert "2: button 1 released -> LED on GPIO 7 off" in said
    no_process_left()


def test_the_first_evening(start: Start, environ: dict[str, str], place: Path) -> None:
    """A master, a node of the workshop, topics, services, parameters."""

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

    # A node of the same name.
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
    """Over a master of Linux, in both directions; the text has an umlaut."""
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
    """All files have CRLF; a node respawns, another is required."""
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
    # The code page of the output has umlauts, and no arrows.
    assert "waiting: Größe" in said
    assert r"Größe \u2192 1" in said
    run.close()
    no_process_left()

    status, said = WINDOWS.run(command("roslaunch"), "pkg", "r.launch", folder=place, environ=environ)
    assert status == 1, said
    assert "REQUIRED process [b-2] has died!" in said


def test_workspace(place: Path, environ: dict[str, str]) -> None:
    """Built, and used through setup.bat."""
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
    """Also while it starts: ended at different moments, and by its command's .exe."""
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
        run = start(command(launcher), *words)
        run.until(moment)
        run.close()
        no_process_left()
