"""minirospy doctor and roswtf: graphs with a fault, and the lines that report the fault."""

from __future__ import annotations

import contextlib
import json
import signal
import socket
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from std_msgs.msg import Bool, String

from minirospy.base.environment import Environment
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.ros.roswtf.commands import doctor
from minirospy.runtime.node.node import Node
from minirospy.runtime.rpc.master_proxy import MasterProxy
from minirospy.runtime.transport.loop import LoopThread
from tests.conftest import free_port

Start = Callable[[Sequence[str]], Any]


@pytest.fixture(autouse=True)
def _patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """Raise the time limits for a busy machine. An address without a listener still refuses immediately."""
    connect_within(30.0, monkeypatch)


def connect_within(seconds: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Set how long the doctor waits for a node or a master."""
    for module in ("", ".master", ".graph", ".listening", ".other_machine", ".own_node"):
        monkeypatch.setattr(f"minirospy.introspect.doctor{module}.CONNECT_SECONDS", seconds)


@pytest.fixture
def other(master: str) -> Iterator[Callable[[str, InterfaceType], None]]:
    """Return a function that makes a node /other subscribe to a topic with a type."""
    loop = LoopThread("other")
    node = Node("/other", Environment.read())
    loop.run(node.start())

    def subscribe(topic: str, type_: InterfaceType) -> None:
        loop.run(node.subscribe(node.make_subscription(topic, type_, lambda *_: None)))

    yield subscribe
    loop.run(node.close())
    loop.close()


@pytest.fixture
def closed_port() -> int:
    return free_port()


def lines(out: str, check: str) -> list[str]:
    """Return the lines that were printed about a check."""
    return [line for line in out.splitlines() if f" {check}: " in line]


def test_a_graph_that_is_well(robot: Any, command: Any) -> None:
    status, out, err = command("doctor")
    assert (status, err) == (0, "")
    checks = [line.split(":")[0] for line in out.splitlines()]

    assert checks == [
        "ok      python",
        "ok      variables",
        "ok      shared memory",
        "ok      own address",
        "ok      master",
        "ok      nodes",
        "ok      return path",
        "warning topics",
        "ok      connections",
        "ok      services",
        "ok      packages",
        "1 warning",
    ], out
    assert (
        "nobody publishes /any (/robot), /listen (/robot) -> start the publisher" in lines(out, "topics")[0]
    )
    # The doctor has unregistered its own node.
    assert command("rosnode", "list").out == "/robot\n"


def test_dead_unresolvable_and_third_party_nodes(
    robot: Any, master: str, closed_port: int, command: Any
) -> None:
    proxy = MasterProxy(master, "/")

    for name, uri in (
        ("/dead", f"http://localhost:{closed_port}/"),
        ("/dead_too", f"http://localhost:{closed_port}/"),
        ("/lost", "http://no-such-host.invalid:1234/"),
        ("/moved", robot.node.uri),
    ):
        proxy.caller_id = name
        proxy.register_publisher("/boo", "std_msgs/Bool", uri)

    proxy.close()
    status, out, _ = command("doctor")
    assert status == 1
    dead, lost, moved = lines(out, "nodes")
    assert dead.startswith(
        "PROBLEM nodes: /dead, /dead_too: nothing listens at their port on 'localhost' -> if they were killed"
    )
    assert lost.startswith(
        "PROBLEM nodes: /lost: are registered as being at 'no-such-host.invalid', a name that this"
    )
    assert moved.startswith(
        "PROBLEM nodes: /moved: another program answers at their port on 'localhost': it is the node /robot"
    )
    assert out.splitlines()[-1] == "3 problems and 1 warning"


def test_a_suspended_node_and_a_suspended_master(
    robot: Any, master: str, command: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After Ctrl-Z, the system still accepts connections for a stopped process."""
    connect_within(1.5, monkeypatch)
    with socket.create_server(("127.0.0.1", 0)) as suspended:
        uri = f"http://localhost:{suspended.getsockname()[1]}/"
        with contextlib.closing(MasterProxy(master, "/stopped")) as proxy:
            proxy.register_publisher("/boo", "std_msgs/Bool", uri)
        resume = "it is busy, or suspended: after Ctrl-Z, `fg` in its terminal continues it"

        status, out, _ = command("doctor")
        (node,) = lines(out, "nodes")
        assert status == 1
        assert node.startswith(
            "PROBLEM nodes: /stopped: connections to it on 'localhost' are accepted, but nothing"
        )
        assert node.endswith(f" -> {resume}")

        monkeypatch.setenv("ROS_MASTER_URI", uri)
        status, out, _ = command("doctor")
        (silent,) = lines(out, "master")
        assert status == 1
        assert silent.startswith("PROBLEM master: http://localhost:")
        assert silent.endswith(f" -> {resume}")


def test_topics_of_different_types(robot: Any, other: Any, command: Any) -> None:
    other("/button_state", InterfaceType(String._type, String._md5sum, String._full_text))
    status, out, _ = command("doctor")
    assert status == 1
    problem, _ = lines(out, "topics")
    assert (
        "/button_state has nodes of different types, which never connect: std_msgs/Bool: /robot; std_msgs/String: /other"
        in problem
    )


def test_a_connection_that_is_not_made(robot: Any, other: Any, command: Any) -> None:
    """The nodes' types have the same name but different definitions."""
    other("/button_state", InterfaceType(Bool._type, "0" * 32))
    status, out, _ = command("doctor")
    assert status == 1
    (line,) = lines(out, "connections")
    assert line.startswith(
        "PROBLEM connections: /other does not get /button_state of /robot -> run `minirospy doctor` on"
    )


def test_a_service_that_is_dead(robot: Any, master: str, closed_port: int, command: Any) -> None:
    proxy = MasterProxy(master, "/robot")
    proxy.register_service("/haunt", f"rosrpc://localhost:{closed_port}", robot.node.uri)
    proxy.close()
    status, out, _ = command("doctor")
    assert status == 1
    (line,) = lines(out, "services")
    assert line.startswith(
        "PROBLEM services: /haunt of /robot does not answer: connection refused -> start its node again"
    )


def test_without_a_master(command: Any, monkeypatch: pytest.MonkeyPatch, closed_port: int) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", f"http://localhost:{closed_port}")
    status, out, _ = command("doctor")
    assert status == 1
    assert lines(out, "master") == [
        f"PROBLEM master: none runs on this machine at http://localhost:{closed_port} (127.0.0.1) -> "
        "start `roscore`, or set ROS_MASTER_URI to the machine where it runs"
    ]
    assert lines(out, "packages")
    status, out, _ = command("doctor", "--offline")
    assert (status, lines(out, "master"), out.splitlines()[-1]) == (0, [], "all is well")


def test_another_machine(robot: Any, command: Any) -> None:
    status, out, _ = command("doctor", "localhost", "robot.invalid")
    assert status == 1
    assert lines(out, "other machine") == [
        "ok      other machine: localhost (127.0.0.1) is this machine",
        "PROBLEM other machine: this machine does not know the name 'robot.invalid' -> give the address of that machine, "
        "or add 'robot.invalid' to the hosts file of this one",
    ]
    assert lines(out, "both directions") == []
    status, _, err = command("doctor", "--offline", "robot")
    assert (status, "to try another machine needs the network" in err) == (2, True)


def test_json(robot: Any, command: Any) -> None:
    found = [json.loads(line) for line in command("doctor", "--json").out.splitlines()]
    assert {"check": "services", "status": "ok", "text": "2, all answer", "advice": ""} in found


def test_typed_wrong(command: Any) -> None:
    assert command("doctor", "--nothing").status == 2
    assert command("doctor", "--listen", "--offline").status == 2


def test_roswtf_and_launch_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    good, bad, broken = (tmp_path / name for name in ("good.launch", "bad.launch", "broken.launch"))
    node = '<launch>\n<node name="led" pkg="rpi_feros" type="{}"/>\n</launch>'
    good.write_text(node.format("$(arg kind).py").replace("<node", '<arg name="kind"/><node'))
    bad.write_text(node.format("led_actuator"))
    broken.write_text("<launch>")
    assert doctor.roswtf(["--offline", "--all", "--no-plugins", str(good), "kind:=led_actuator"]) == 0
    assert f"ok      launch file: {good}: 1 node(s), all programs are there" in capsys.readouterr().out
    assert doctor.roswtf(["--offline", str(bad), str(broken), str(tmp_path / "none.launch")]) == 1
    one, two, three = lines(capsys.readouterr().out, "launch file")
    assert f"PROBLEM launch file: {bad}:2: " in one
    assert "led_actuator.py" in one
    assert str(broken) in two
    assert "none.launch is not a file" in three


def test_a_doctor_that_listens(robot: Any, command: Any, program: Start) -> None:
    listener = program(["minirospy", "doctor", "--listen"])
    while not (said := listener.stdout.readline()).startswith("listening: "):
        assert said
    assert said == "listening: type `minirospy doctor` on the other machine; Ctrl-C ends this\n"
    status, out, _ = command("doctor")
    assert status == 0
    one, _ = [line for line in out.splitlines() if " both directions: " in line or "clock: that of " in line]
    assert one.startswith("ok      both directions: this machine reaches ")
    assert "it reaches this machine, and this one reaches it" in listener.stdout.readline()
    listener.send_signal(signal.SIGTERM)
    assert listener.wait(30) == 0
    assert command("rosnode", "list").out == "/robot\n"


def test_a_name_that_is_nearly_a_published_one(
    robot: Any, other: Callable[[str, InterfaceType], None], command: Any
) -> None:
    other("/buton_state", InterfaceType(Bool._type, Bool._md5sum))
    (line,) = lines(command("doctor").out, "topics")
    assert "/buton_state (/other; /button_state is published), /listen (/robot) -> " in line
