"""Error messages name the cause of a failure."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from minirospy.base.environment import Environment, wrong_address
from minirospy.base.errors import LaunchError, NotFoundError
from minirospy.ros.roslaunch.launcher.load import load_text
from minirospy.workspace.packages import Packages

NODE = """
import rospy
rospy.init_node("node")
print("up", flush=True)
rospy.spin()
"""
PUBLISH = """
import rospy
from geometry_msgs.msg import Twist

rospy.init_node("publisher")
rospy.Subscriber("speed", Twist, print)
publisher = rospy.Publisher("speed", Twist, queue_size=1)
publisher.wait_for_subscribers(1)
twist = Twist()
twist.linear.x = "fast"
publisher.publish(twist)
"""


def test_name_of_a_master_that_has_no_address(
    monkeypatch: pytest.MonkeyPatch, command: Any, tmp_path: Path
) -> None:
    def unknown(*_: object, **__: object) -> None:
        raise socket.gaierror(socket.EAI_NONAME, "Name or service not known")

    monkeypatch.setattr(socket, "getaddrinfo", unknown)
    monkeypatch.setenv("ROS_MASTER_URI", "http://robot.invalid:11311")
    # Without a terminal, only ROS's line is printed.
    monkeypatch.setattr("minirospy.command.command._has_terminal", lambda: True)
    status, _, err = command("rostopic", "list")
    assert status == 1
    assert "the name [robot.invalid] has no address here: set ROS_MASTER_URI to its IP address" in err

    (tmp_path / "a.launch").write_text('<launch><node name="n" pkg="p" type="t"/></launch>')
    status, _, err = command("roslaunch", str(tmp_path / "a.launch"))
    assert status == 1
    assert "the name [robot.invalid] has no address here: set ROS_MASTER_URI to its IP address" in err


def test_address_of_another_machine_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ROS_HOSTNAME", raising=False)
    # This address is reserved for documentation, so no machine has it (RFC 5737).
    monkeypatch.setenv("ROS_IP", "192.0.2.1")
    assert wrong_address(Environment.read()) == (
        "ROS_IP=192.0.2.1 is not an address of this machine: correct only behind NAT or in a container"
    )
    monkeypatch.setenv("ROS_IP", "127.0.0.1")
    assert wrong_address(Environment.read()) == ""


def test_node_warns_of_the_address_of_another_machine(master: str) -> None:
    program = "import rospy; rospy.init_node('node')"
    environment = {key: value for key, value in os.environ.items() if key != "ROS_HOSTNAME"}
    done = subprocess.run(
        [sys.executable, "-c", program],
        env={**environment, "ROS_IP": "192.0.2.1", "ROS_MASTER_URI": master},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0
    assert "ROS_IP=192.0.2.1 is not an address of this machine" in done.stderr


@pytest.mark.skipif(not hasattr(signal, "SIGSTOP"), reason="Windows suspends no process")
def test_suspended_node_is_said_to_be_suspended(master: str, command: Any) -> None:
    with subprocess.Popen([sys.executable, "-c", NODE], stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "up\n"
            process.send_signal(signal.SIGSTOP)
            # Wait until the process has stopped: its other threads run until one of them has handled the signal.
            os.waitid(os.P_PID, process.pid, os.WSTOPPED)
            echo = [str(Path(sys.executable).parent / "rostopic"), "echo", "/rosout"]
            with subprocess.Popen(echo, stderr=subprocess.PIPE, text=True) as reader:
                assert reader.stderr is not None
                status, _, err = command("rosnode", "ping", "-c", "1", "/node")
                warning = reader.stderr.readline()
                reader.terminate()
        finally:
            process.send_signal(signal.SIGCONT)
            process.terminate()
    assert status == 0
    assert "suspended: after Ctrl-Z, `fg` in its terminal continues it" in err
    assert "cannot connect to the publisher" in warning
    assert "suspended: after Ctrl-Z, `fg` in its terminal continues it" in warning


def test_wrong_type_in_publish_is_one_traceback(master: str) -> None:
    done = subprocess.run([sys.executable, "-c", PUBLISH], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr.count("Traceback") == 1
    assert done.stderr.endswith(
        "ROSSerializationException: field linear.x must be float type\n"
        "(topic /speed, type geometry_msgs/Twist)\n"
    )


def test_package_that_hides_another_says_so(tmp_path: Path) -> None:
    for root, program in (("own", "mine.py"), ("ours", "solution.py")):
        folder = tmp_path / root / "bringup"
        (folder / "launch").mkdir(parents=True)
        (folder / "package.xml").write_text("<package><name>bringup</name></package>")
        (folder / program).write_text("#!/usr/bin/env python3\n")
        (folder / "launch" / f"{program}.launch").write_text("<launch/>")

    packages = Packages.below(tmp_path / "own", tmp_path / "ours")
    hint = f"the package of that name in {tmp_path / 'ours' / 'bringup'}, which this one hides, has it"
    with pytest.raises(NotFoundError) as program_error:
        packages.find_executable("bringup", "solution.py")
    with pytest.raises(NotFoundError) as file_error:
        packages.find_resource("bringup", "solution.py.launch")
    assert hint in str(program_error.value)
    assert hint in str(file_error.value)
    include = '<launch><include file="$(find bringup)/launch/solution.py.launch"/></launch>'
    with pytest.raises(LaunchError) as include_error:
        load_text(include, {}, packages, {})
    assert hint in str(include_error.value)
    with pytest.raises(NotFoundError) as unknown:
        packages.find_executable("bringup", "nobody.py")
    assert "this one hides" not in str(unknown.value)
