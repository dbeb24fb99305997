"""`roscore --local` and MINIROSPY_LOCAL=1: the graph cannot be reached from other machines."""

from __future__ import annotations

import contextlib
import os
import socket
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import psutil
import pytest

from minirospy.base.environment import Environment
from minirospy.ros.roslaunch.launcher.command import node_environment
from minirospy.ros.roslaunch.launcher.spec import NodeSpec
from minirospy.runtime.node.node import Node
from minirospy.runtime.transport.loop import LoopThread
from tests.conftest import free_port

BIN = Path(sys.executable).parent


@contextlib.contextmanager
def started(*command: str, until: str, **environ: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Start a command; yield it, and its output up to a line that contains ``until``."""
    process = subprocess.Popen(
        [str(BIN / command[0]), *command[1:]],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env={**os.environ, **environ},
    )
    assert process.stdout

    printed = ""

    try:
        for line in process.stdout:
            printed += line
            if until in line:
                break
        yield process, printed
    finally:
        process.terminate()
        process.communicate(timeout=60)


def run(*command: str, **environ: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [str(BIN / command[0]), *command[1:]],
        capture_output=True,
        text=True,
        timeout=60,
        env={**os.environ, **environ},
        check=False,
    )


def listening(process: psutil.Process) -> set[str]:
    """Return the addresses on which a process and its children listen."""
    found: set[str] = set()
    for each in (process, *process.children(recursive=True)):
        # psutil 6 renamed this method.
        connections: Any = getattr(each, "net_connections", None) or each.connections
        found |= {c.laddr.ip for c in connections("inet") if c.status == psutil.CONN_LISTEN}
    return found


@pytest.fixture
def elsewhere(monkeypatch: pytest.MonkeyPatch) -> Mapping[str, str]:
    """Set and return variables that a user's ~/.bashrc may set for other work."""
    monkeypatch.delenv("ROS_HOSTNAME")
    monkeypatch.delenv("ROS_MASTER_URI", raising=False)
    monkeypatch.setenv("ROS_IP", "192.0.2.7")
    return {"ROS_IP": "192.0.2.7"}


@pytest.mark.parametrize("how", ["--local", "MINIROSPY_LOCAL=1"])
def test_a_local_roscore_listens_on_loopback_alone(how: str, elsewhere: Mapping[str, str]) -> None:
    port = free_port()
    options = [how] if how == "--local" else []
    environ = {} if options else {"MINIROSPY_LOCAL": "1"}
    with started("roscore", *options, "-p", str(port), until="Ctrl-C", **environ) as (process, printed):
        assert f"WARNING: {how} keeps the master on this machine: ROS_IP=192.0.2.7 has no effect\n" in printed
        assert (
            f"listening on 127.0.0.1:{port}, open to this machine alone; nodes stay on it with "
            "`export MINIROSPY_LOCAL=1`\n" in printed
        )
        assert f"ROS_MASTER_URI=http://localhost:{port}/\n" in printed
        # The master's own /rosout node listens there, too.
        assert listening(psutil.Process(process.pid)) == {"127.0.0.1"}
        names = run("rosnode", "list", ROS_MASTER_URI=f"http://localhost:{port}", MINIROSPY_LOCAL="1")
        assert names.stdout == "/rosout\n"


def test_roscore_suggests_local_if_everyone_may_connect(elsewhere: Mapping[str, str]) -> None:
    with started("roscore", "-p", str(free_port()), until="Ctrl-C", ROS_HOSTNAME=socket.gethostname()) as (
        _,
        printed,
    ):
        if "listening on 0.0.0.0" in printed:
            assert ", open to everybody; `roscore --local` opens it to this machine alone\n" in printed


def test_a_local_roscore_takes_the_port_alone_from_a_foreign_master_uri(elsewhere: Mapping[str, str]) -> None:
    port = free_port()
    uri = f"http://192.0.2.200:{port}"
    with started("roscore", "--local", until="nodes find it", ROS_MASTER_URI=uri) as (_, printed):
        assert (
            f"ROS_MASTER_URI [{uri}] host is not set to this machine: "
            f"nodes find it with ROS_MASTER_URI=http://localhost:{port}\n" in printed
        )


def test_a_local_node_listens_on_loopback_alone(
    master: str, elsewhere: Mapping[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MINIROSPY_LOCAL", "1")
    monkeypatch.setenv("ROS_MASTER_URI", master)
    before = listening_sockets()
    loop = LoopThread("local")
    node = Node("/node", Environment.read())
    loop.run(node.start())
    try:
        assert node.uri.startswith("http://localhost:")
        opened = listening_sockets() - before
        assert len(opened) == 2
        assert {address for address, _ in opened} == {"127.0.0.1"}
    finally:
        loop.run(node.close())
        loop.close()


def listening_sockets() -> set[tuple[str, int]]:
    process: Any = psutil.Process()
    connections = getattr(process, "net_connections", None) or process.connections
    return {tuple(c.laddr) for c in connections("inet") if c.status == psutil.CONN_LISTEN}


@pytest.mark.parametrize(
    "command",
    [
        ["rostopic", "list"],
        ["rosnode", "list"],
        ["rosparam", "list"],
        ["rosservice", "list"],
        ["rostopic", "echo", "/t"],
        ["roslaunch", "rpi_feros_bringup", "rpi_led.launch"],
        ["rosrun", "rpi_feros", "led_actuator.py"],
        ["roscore", "--status"],
    ],
    ids=" ".join,
)
def test_a_local_command_refuses_the_master_of_another_machine_in_one_line(command: list[str]) -> None:
    done = run(*command, MINIROSPY_LOCAL="1", ROS_MASTER_URI="http://192.0.2.200:11311")
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1
    assert (
        "MINIROSPY_LOCAL=1 keeps everything on this machine, but the master [http://192.0.2.200:11311]"
        in done.stderr
    )


def test_a_local_roslaunch_starts_a_local_master_and_local_nodes(
    tmp_path: Path, elsewhere: Mapping[str, str]
) -> None:
    file = tmp_path / "a.launch"
    file.write_text(
        '<launch><node pkg="rostopic" type="rostopic" name="a" args="pub /t std_msgs/Bool true"/></launch>'
    )
    uri = f"http://localhost:{free_port()}"
    environ = {"MINIROSPY_LOCAL": "1", "ROS_MASTER_URI": uri}
    with started("roslaunch", str(file), until="process[a-2]", **environ) as (process, printed):
        assert f"ROS_MASTER_URI={uri}" in printed
        for _ in range(100):
            if "/t\n" in run("rostopic", "list", **environ).stdout:
                break
        assert listening(psutil.Process(process.pid)) == {"127.0.0.1"}


def test_a_local_roslaunch_refuses_nodes_of_other_machines(tmp_path: Path) -> None:
    file = tmp_path / "a.launch"
    file.write_text(
        '<launch><machine name="m" address="192.0.2.200"/>\n'
        '<node pkg="rostopic" type="rostopic" name="a" machine="m"/></launch>'
    )
    environ = {"MINIROSPY_LOCAL": "1", "ROS_MASTER_URI": f"http://localhost:{free_port()}"}
    done = run("roslaunch", str(file), **environ)
    assert done.returncode == 1
    assert (
        "a.launch:2: node [/a] is for machine [m], and MINIROSPY_LOCAL=1 keeps everything on this machine"
        in done.stderr
    )


def test_roslaunch_exports_what_nodes_of_other_clients_understand(monkeypatch: pytest.MonkeyPatch) -> None:
    environment = Environment.read({"MINIROSPY_LOCAL": "1"})
    found = node_environment(
        NodeSpec("/a", "pkg", "type"), environment, {"MINIROSPY_LOCAL": "1", "ROS_IP": "192.0.2.7"}
    )
    assert found["ROS_HOSTNAME"] == "localhost"
    assert "ROS_IP" not in found
