"""A robot with two joints, its controllers in a workspace's package, and programs that run beside them."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from minirospy.workspace.packages import Packages
from tests.conftest import write_files
from tests.ros.control.forks import run_program

SECONDS = 100.0

Start = Callable[..., "Program"]

MANIFEST = """<package format="2"><name>{name}</name><version>0.1.0</version><description>Controllers</description>
<maintainer email="a@b.c">me</maintainer><license>BSD</license>
<export><controller_interface plugin="${{prefix}}/plugins.xml"/></export></package>
"""
PLUGIN = """<library path="{name}">
  <class name="{name}/Hold" type="{name}.hold.Hold" base_class_type="controller_interface::ControllerBase"/>
  <class name="{name}/Faulty" type="{name}.hold.Faulty" base_class_type="controller_interface::ControllerBase"/>
  <class name="{name}/Broken" type="{name}.broken.Broken" base_class_type="controller_interface::ControllerBase"/>
  <class name="{name}/Cpp" type="{name}::Cpp" base_class_type="controller_interface::ControllerBase"/>
  <class name="{name}/Other" type="{name}.hold.Other" base_class_type="controller_interface::ControllerBase"/>
</library>
"""
CONTROLLERS = """import math
from controller_interface import Controller
from hardware_interface import Interface


class Hold(Controller):
    interfaces = (Interface.POSITION,)

    def init(self, hardware, context):
        self.name = context.name
        self.step = context.parameters.number("step", 0.0)
        self.joint = hardware.joint(context.parameters.text("joint", ""), Interface.POSITION)

    def starting(self, time):
        print(self.name, "starts", time.to_nsec(), flush=True)

    def update(self, time, period):
        self.joint.position_command = self.joint.position + self.step

    def stopping(self, time):
        print(self.name, "stops", flush=True)

    def close(self):
        print(self.name, "closes", flush=True)


class Faulty(Hold):
    def update(self, time, period):
        raise RuntimeError("no oil")  # line 29


class Other:
    pass
"""

ROBOT = """import os
import sys
import time as time_
import rospy
from controller_manager import run
from hardware_interface import Interface, RobotHardware


class Robot(RobotHardware):
    def read(self, time, period):
        for joint in self.joints.values():
            if joint.active is not None:
                joint.position = joint.position_command

    def write(self, time, period):
        for joint in self.joints.values():
            if joint.active is not None:
                print(f"{joint.name} {joint.position_command:.3f} {period.to_nsec()}", flush=True)
        time_.sleep(0.03 if os.path.exists("slow") else 1000 if os.path.exists("hangs") else 0)
        if os.path.exists("fails"):
            raise OSError("the cable is loose")

    def close(self):
        print("closed, active:", [joint.active for joint in self.joints.values()], flush=True)


rospy.init_node("robot")
robot = Robot()
robot.add_joint("a", Interface.POSITION)
robot.add_joint("b", Interface.POSITION)
status = run(robot, float(rospy.get_param("~rate", 100.0)))
print("status", status, flush=True)
sys.exit(status)
"""


class Program:
    """A running program, whose output is read line by line."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.process = process
        self.lines: list[str] = []

    def read_until(self, text: str) -> str:
        """Return the first further line of standard output that contains a text."""
        assert self.process.stdout
        for line in self.process.stdout:
            self.lines.append(line.rstrip("\n"))
            if text in line:
                return line.rstrip("\n")
        assert self.process.stderr
        raise AssertionError(f"no line with {text!r}: {self.lines} {self.process.stderr.read()}")

    def end(self) -> tuple[int, str, str]:
        """Wait for the end; return the status, the rest of the output, and the errors."""
        output, errors = self.process.communicate(timeout=SECONDS)
        self.lines += output.splitlines()
        assert "Traceback" not in errors, errors
        return self.process.returncode, output, errors


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Write a package with controllers that was not built; return its folder."""
    folder = tmp_path / "src" / "my_controllers"
    module = "src/my_controllers/"
    write_files(
        folder,
        {
            "package.xml": MANIFEST.format(name="my_controllers"),
            "plugins.xml": PLUGIN.format(name="my_controllers"),
            module + "__init__.py": "",
            module + "hold.py": CONTROLLERS,
            module + "broken.py": "import nothing_of_that_name\n",
        },
    )
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "src"))
    return folder


@pytest.fixture
def start(master: str, workspace: Path) -> Iterator[Start]:
    """Return a function that starts a program of a package, or Python code if the package is "-c"; end all after the test."""
    with ExitStack() as running:

        def run(package: str, program: str, *words: str) -> Program:
            command = [sys.executable, "-c", program]
            if package != "-c":
                command = Packages().find_executable(package, program)
            process = subprocess.Popen(
                [*command, *words],
                cwd=workspace.parent,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
            )
            running.callback(_end, process)
            return Program(process)

        yield run


def _end(process: subprocess.Popen[str]) -> None:
    process.kill()
    process.wait()
    for pipe in (process.stdout, process.stderr):
        if pipe:
            pipe.close()


def call(code: str) -> str:
    """Return the output of a program that has the functions of controller_manager_interface, as ``cm``, and ``rospy``."""
    head = "import rospy\nfrom controller_manager import controller_manager_interface as cm\n"
    done = run_program(head + code, Path.cwd())
    assert done.returncode == 0, done.stderr
    return done.stdout
