"""rosnode: output as in real ROS, and exit statuses."""

from __future__ import annotations

import io
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Sequence
from contextlib import closing
from typing import Any

import pytest

from minirospy.introspect import nodes
from minirospy.runtime.rpc.master_proxy import MasterProxy
from tests.conftest import free_port
from tests.waiting import wait_until

Start = Callable[[Sequence[str]], "subprocess.Popen[str]"]


@pytest.fixture
def ghost(master: str) -> str:
    """Return the URI of /ghost, which is registered but does not respond."""
    uri = f"http://localhost:{free_port()}/"
    proxy = MasterProxy(master, "/ghost")
    proxy.register_publisher("/boo", "std_msgs/Bool", uri)
    proxy.register_subscriber("/listen", "std_msgs/Bool", uri)
    proxy.register_service("/haunt", "rosrpc://localhost:1", uri)
    proxy.close()
    return uri


def test_list(robot: Any, ghost: str, command: Any) -> None:
    uri = robot.node.uri
    assert command("rosnode", "list") == (0, "/ghost\n/robot\n", "")
    assert command("rosnode", "list", "/robot").out == "/robot\n"
    assert command("rosnode", "list", "/nope").out == "\n"
    assert command("rosnode", "list", "-u").out == f"{ghost}\n{uri}\n"
    assert command("rosnode", "list", "-a").out == f"{ghost} \t/ghost\n{uri} \t/robot\n"


def test_info(robot: Any, command: Any) -> None:
    expected = (
        "-" * 80 + "\nNode [/robot]\nPublications: \n * /button_state [std_msgs/Bool]\n"
        " * /ns/chatter [std_msgs/String]\n * /poly [geometry_msgs/PolygonStamped]\n\n"
        "Subscriptions: \n * /any [unknown type]\n * /listen [unknown type]\n\n"
        "Services: \n * /fail\n * /set_led_state\n\n"
    )  # fmt: skip
    assert command("rosnode", "info", "-q", "robot") == (0, expected, "")
    status, out, err = command("rosnode", "info", "/robot")
    assert (status, err) == (0, "")
    assert re.fullmatch(
        re.escape(f"{expected}\ncontacting node {robot.node.uri} ...\n") + r"Pid: \d+\n\n", out
    )


def test_info_shows_connections(robot: Any, program: Start, command: Any) -> None:
    echo = program(["rostopic", "echo", "/button_state"])
    assert echo.stdout is not None
    assert echo.stdout.readline() == "data: True\n"
    (name,) = [each for each in command("rosnode", "list").out.split() if each != "/robot"]
    there = command("rosnode", "info", "/robot").out
    assert f"Connections:\n * topic: /button_state\n    * to: {name}\n    * direction: outbound" in there
    # A Unix socket has no ports, and real ROS prints nothing for a connection without ports.
    is_unix = sys.platform == "linux"
    ports = "" if is_unix else r" \(\d+ - \S+:\d+\) \[\d+\]"
    assert re.search(rf"outbound{ports}\n    \* transport: TCPROS\n", there)
    here = command("rosnode", "info", name).out
    assert f" * topic: /button_state\n    * to: /robot ({robot.node.uri})\n    * direction: inbound" in here
    assert re.search(rf"inbound{ports}\n    \* transport: TCPROS\n", here)


def test_info_shows_the_ports_of_a_connection(
    robot: Any, program: Start, command: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MINIROSPY_TRANSPORT", "tcp")
    echo = program(["rostopic", "echo", "/button_state"])
    assert echo.stdout is not None
    assert echo.stdout.readline() == "data: True\n"
    (name,) = [each for each in command("rosnode", "list").out.split() if each != "/robot"]
    for node, direction in (("/robot", "outbound"), (name, "inbound")):
        said = command("rosnode", "info", node).out
        assert re.search(rf"{direction} \(\d+ - \S+:\d+\) \[\d+\]\n    \* transport: TCPROS\n", said)


def test_a_node_that_does_not_answer(robot: Any, ghost: str, command: Any) -> None:
    status, out, err = command("rosnode", "info", "/ghost")
    assert status == 1
    assert out.endswith(f"contacting node {ghost} ...\n")
    assert err.startswith(f"rosnode: ERROR: node [/ghost] does not answer at {ghost}")
    assert "Errno" not in err
    assert command("rosnode", "ping", "/ghost").status == 0
    status, out, err = command("rosnode", "ping", "-a")
    assert status == 0
    assert out.startswith(
        "Will ping the following nodes: \n * /ghost\n * /robot\n\npinging /ghost with a timeout"
    )
    assert f"xmlrpc reply from {robot.node.uri}\ttime=" in out
    assert err.count("\n") == 1


def test_ping(robot: Any, command: Any, program: Start, monkeypatch: pytest.MonkeyPatch) -> None:
    uri = re.escape(robot.node.uri)
    status, out, err = command("rosnode", "ping", "-c", "1", "robot")
    assert "average" not in out

    monkeypatch.setattr("minirospy.ros.rosnode.commands.rosnode.time.sleep", lambda _: None)
    status, out, err = command("rosnode", "ping", "-c", "2", "robot")
    assert (status, err) == (0, "")
    assert re.fullmatch(
        r"rosnode: node is \[/robot\]\npinging /robot with a timeout of 3\.0s\n"
        rf"(xmlrpc reply from {uri}\ttime=\d+\.\d{{6}}ms\n){{2}}ping average: \d+\.\d{{6}}ms\n",
        out,
    )

    ping = program(["rosnode", "ping", "/robot"])
    assert ping.stdout is not None
    while not ping.stdout.readline().startswith("xmlrpc reply"):
        pass
    ping.send_signal(signal.SIGINT if sys.platform != "win32" else signal.SIGTERM)
    out, err = ping.communicate(timeout=30)

    assert (ping.returncode, err) == (0, "")
    assert "ping average: " in out


def test_kill(robot: Any, command: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    assert command("rosnode", "kill", "/robot") == (0, "killing /robot\nkilled\n", "")
    wait_until(lambda: robot.stopped)
    assert "user request" in robot.stopped[0]
    monkeypatch.setattr(sys, "stdin", io.StringIO("x\n7\n1\n"))
    out = command("rosnode", "kill").out
    assert out.startswith(
        "1. /robot\n\nPlease enter the number of the node you wish to kill.\n> ERROR: please"
    )
    assert out.endswith("> killing /robot\nkilled\n")
    assert command("rosnode", "kill", "-a").out == "killing /robot\nkilled\n"


def test_a_node_that_hangs_is_not_killed(
    robot: Any, master: str, command: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("minirospy.introspect.nodes.SHUTDOWN_SECONDS", 0.1)
    with socket.create_server(("127.0.0.1", 0)) as silent, closing(MasterProxy(master, "/hung")) as proxy:
        uri = f"http://localhost:{silent.getsockname()[1]}/"
        proxy.register_publisher("/t", "std_msgs/Bool", uri)
        status, out, err = command("rosnode", "kill", "/hung")
        assert (status, out) == (1, "killing /hung\n")
        assert err.startswith(
            f"rosnode: ERROR: node [/hung] does not answer at {uri} (timed out after 0.1 s): "
        )
        # Give the robot time to respond.
        slave = nodes._slave
        monkeypatch.setattr(
            nodes,
            "_slave",
            lambda graph, node, _: slave(graph, node, 0.1 if node.name == "/hung" else 30.0),
        )
        status, out, err = command("rosnode", "kill", "-a")
        assert (status, out) == (1, "killing:\n * /hung\n * /robot\nkilled\n")
    wait_until(lambda: robot.stopped)


def test_cleanup(robot: Any, ghost: str, command: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO("n\n"))
    assert command("rosnode", "cleanup").out.endswith("aborting\n")
    assert "/ghost\n" in command("rosnode", "list").out
    monkeypatch.setattr(sys, "stdin", io.StringIO("what\ny\n"))
    status, out, _ = command("rosnode", "cleanup")
    assert status == 0
    assert out.startswith("Unable to contact the following nodes:\n * /ghost\nWarning: ")
    assert out.endswith("Unregistering /ghost\ndone\n")
    assert command("rosnode", "list").out == "/robot\n"
    assert command("rosservice", "list").out == "/fail\n/set_led_state\n"
    assert command("rosnode", "cleanup") == (0, "", "")


def test_machines(robot: Any, command: Any) -> None:
    assert command("rosnode", "machine").out == "localhost\n"
    assert command("rosnode", "machine", "localhost").out == "/robot\n"
    assert command("rosnode", "machine", "127.0.0.1").out == "/robot\n"
    assert command("rosnode", "machine", "nowhere.invalid").status == 1


@pytest.mark.parametrize("verb", ["info", "ping", "kill"])
def test_unknown_nodes(robot: Any, command: Any, verb: str) -> None:
    status, _, err = command("rosnode", verb, "/robt")
    # ROS exits with the same status.
    expected = 1 if verb == "kill" else 0
    assert (status, err) == (expected, "rosnode: ERROR: node [/robt] not found; did you mean /robot?\n")


def test_help_and_no_master(command: Any) -> None:
    for verb in ("ping", "list", "info", "machine", "kill", "cleanup"):
        assert f"\trosnode {verb}\t" in command("rosnode", "-h").out
        assert command("rosnode", verb, "-h").status == 0
    for argv in (["list"], ["info", "/a"], ["ping", "/a"], ["kill", "/a"], ["machine"], ["cleanup"]):
        status, out, err = command("rosnode", *argv)
        ros_output = {"ping": "rosnode: node is [/a]\n", "info": "-" * 80 + "\n"}
        assert (status, out) == (1, ros_output.get(argv[0], ""))
        assert err == "ERROR: Unable to communicate with master!\n"


def test_the_program(robot: Any, program: Start) -> None:
    assert program(["rosnode", "list"]).communicate(timeout=30) == ("/robot\n", "")


def test_one_unknown_node_among_several(robot: Any, command: Any) -> None:
    status, out, err = command("rosnode", "info", "-q", "/nope", "/robot")
    assert status == 0
    assert "Node [/robot]\n" in out
    assert err == "rosnode: ERROR: node [/nope] not found\n"
    status, out, err = command("rosnode", "kill", "/robot", "/nope", "/nada")
    assert (status, out) == (1, "")
    assert err == "rosnode: ERROR: node [/nope] not found\nrosnode: ERROR: node [/nada] not found\n"
    assert not robot.stopped


def test_ping_all_takes_nothing_else(robot: Any, command: Any) -> None:
    assert command("rosnode", "ping", "-a", "-c", "2").status == 2
    assert command("rosnode", "ping", "-a", "/robot").status == 2


def test_machine_without_a_master(command: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", f"http://localhost:{free_port()}")
    unknown = command("rosnode", "machine", "nope.invalid")
    assert (unknown.status, unknown.err) == (
        1,
        "ERROR: cannot resolve machine name [nope.invalid] to address\n",
    )
    known = command("rosnode", "machine", "localhost")
    assert (known.status, known.err) == (1, "ERROR: Unable to communicate with master!\n")
