"""rosservice: output as in real ROS, and exit statuses."""

from __future__ import annotations

import io
import os
import struct
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from gazebo_msgs.srv import SetLightProperties
from mavros_msgs.srv import CommandVtolTransition

from minirospy.core.wire.tcpros import InterfaceType
from minirospy.ros.rosservice.commands.rosservice import main
from minirospy.runtime.rpc.master_proxy import MasterProxy
from tests.conftest import modules_loaded_by

from .conftest import own_lines

BIN = Path(sys.executable).parent
Start = Callable[[Sequence[str]], "subprocess.Popen[str]"]


def test_list(robot: Any, command: Any) -> None:
    assert command("rosservice", "list") == (0, "/fail\n/set_led_state\n", "")
    assert command("rosservice", "list", "-n").out == "/fail /robot\n/set_led_state /robot\n"
    assert command("rosservice", "list", "/fail").out == "/fail\n"
    assert command("rosservice", "list", "/nope") == (0, "", "")


def test_what_a_service_is(robot: Any, command: Any) -> None:
    uri = robot.node.service_uri
    assert command("rosservice", "type", "/set_led_state").out == "std_srvs/SetBool\n"
    assert command("rosservice", "uri", "set_led_state").out == f"{uri}\n"
    assert command("rosservice", "node", "set_led_state") == (0, "/robot\n", "")
    assert command("rosservice", "args", "/set_led_state").out == "data\n"
    assert command("rosservice", "args", "/fail").out == "\n"
    assert command("rosservice", "info", "/set_led_state").out == (
        f"Node: /robot\nURI: {uri}\nType: std_srvs/SetBool\nArgs: data\n"
    )
    assert command("rosservice", "find", "std_srvs/Trigger").out == "/fail\n"
    assert command("rosservice", "find", "std_srvs/Nope").out == "\n"


def test_a_call_imports_little(robot: Any) -> None:
    code = (
        "from minirospy.ros.rosservice.commands.rosservice import main; assert main(['type', '/fail']) == 0; "
        "assert main(['call', '/set_led_state', 'True']) == 0"
    )
    assert not {"asyncio", "numpy", "logging", "xmlrpc.client"} & modules_loaded_by(code)


@pytest.mark.parametrize(
    "arguments", [["data: True"], ["{data: True}"], ["True"], ["1"], ["true"], ["data: True", "--wait"]]
)
def test_call_the_workshops_way(robot: Any, command: Any, arguments: list[str]) -> None:
    assert command("rosservice", "call", "/set_led_state", *arguments) == (
        0,
        'success: True\nmessage: "Successfully changed LED state."\n',
        "",
    )


def test_header_of_a_request_is_numbered(robot: Any, command: Any) -> None:
    def answer(body: memoryview, _: object) -> bytes:
        (sequence,) = struct.unpack_from("<I", body)
        return struct.pack("<?B", True, sequence)

    type_ = InterfaceType("mavros_msgs/CommandVtolTransition", CommandVtolTransition._md5sum)
    server = robot.node.make_service(
        "/vtol", type_, answer, request_type=f"{type_.name}Request", response_type=f"{type_.name}Response"
    )
    robot.loop.run(robot.node.serve(server))
    answered = "success: True\nresult: 1\n"
    assert command("rosservice", "call", "/vtol", "header: {seq: 7}").out == answered
    out = command("rosservice", "call", "-v", "/vtol", "header: {seq: 7}").out
    assert out.startswith("header: \n  seq: 1\n")
    assert out.endswith(f"state: 0\n---\n{answered}")


def test_nested_arguments_are_named(robot: Any, capfd: pytest.CaptureFixture[str]) -> None:
    type_ = InterfaceType("gazebo_msgs/SetLightProperties", SetLightProperties._md5sum)
    names = {"request_type": f"{type_.name}Request", "response_type": f"{type_.name}Response"}
    robot.loop.run(robot.node.serve(robot.node.make_service("/light", type_, lambda *_: b"", **names)))
    assert main(["call", "/light", "light: 1"]) == 2
    arguments = "light_name cast_shadows diffuse.r diffuse.g diffuse.b diffuse.a"
    assert f"Service arguments are: [{arguments} " in capfd.readouterr().err


def test_call_verbosely_and_from_standard_input(
    robot: Any, command: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    answer = 'success: False\nmessage: "Successfully changed LED state."\n'
    assert (
        command("rosservice", "call", "-v", "set_led_state", "data: False").out
        == f"data: False\n---\n{answer}"
    )
    monkeypatch.setattr(sys, "stdin", io.StringIO("data: False\n---\ndata: False\n"))
    assert command("rosservice", "call", "set_led_state").out == answer * 2
    assert command("rosservice", "call", "set_led_state", "{}").out == answer


@pytest.mark.parametrize(
    ("arguments", "status", "why"),
    [
        (["/fail"], 2, "service [/fail] responded with an error: error processing request: bad thing\n"),
        (["/set_led_stat", "True"], 2, "service [/set_led_stat] not found; did you mean /set_led_state?\n"),
        (["/set_led_state", "datum: True"], 2, "No field name [datum] ("),
        (["/set_led_state", "data: 3.5"], 2, "field data is not a bool ("),
        (["/set_led_state", "True", "False"], 2, "Too many arguments"),
        (["/set_led_state", "data: [True"], 1, "'data: [True': "),
        ([], 2, "arguments are required: service"),
    ],
)
def test_calls_that_cannot_be(robot: Any, command: Any, arguments: list[str], status: int, why: str) -> None:
    result = command("rosservice", "call", *arguments)
    assert (result.status, result.out) == (status, "")
    assert why in result.err
    assert len(own_lines(result.err)) == 1


def test_missing_arguments_are_named(robot: Any, command: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO(""))
    result = command("rosservice", "call", "/set_led_state")
    assert (result.status, result.err) == (2, "rosservice: ERROR: please specify service arguments: data\n")


def test_unknown_and_silent_services(robot: Any, master: str, command: Any) -> None:
    for verb in ("type", "uri", "args", "info"):
        status, out, err = command("rosservice", verb, "/fial")
        assert (status, out) == (2 if verb == "args" else 1, "")
        assert err == "rosservice: ERROR: service [/fial] not found; did you mean /fail?\n"
    proxy = MasterProxy(master, "/ghost")
    proxy.register_service("/haunt", "rosrpc://localhost:1", "http://localhost:1/")
    proxy.close()
    status, out, err = command("rosservice", "type", "/haunt")
    assert (status, out) == (2, "")
    assert "does not answer at rosrpc://localhost:1" in err
    assert command("rosservice", "find", "std_srvs/Trigger").out == "/fail\n"


def test_waiting_for_a_service(master: str, command: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """The command polls until the service is registered; here it is registered after the first poll."""
    looked = threading.Event()
    monkeypatch.setattr("minirospy.introspect.services.time.sleep", lambda _: looked.set())
    probes = iter([None, None, "std_srvs/SetBool"])
    monkeypatch.setattr("minirospy.introspect.services._probed_type", lambda *_: next(probes))
    assert command("rosservice", "call", "--wait", "/late", "True").status == 2
    assert looked.is_set()
    assert next(probes, "all asked for") == "all asked for"


def test_help_and_no_master(command: Any) -> None:
    for verb in ("args", "call", "find", "info", "list", "type", "uri"):
        assert f"\trosservice {verb}\t" in command("rosservice", "-h").out
        assert command("rosservice", verb, "-h").status == 0
    assert command("rosservice", "node", "-h").status == 0
    # ROS's help does not contain it, either
    assert "rosservice node" not in command("rosservice", "-h").out
    for argv in (["list"], ["node", "/a"], ["info", "/a"], ["call", "/a"], ["find", "std_srvs/Empty"]):
        status, out, err = command("rosservice", *argv)
        assert (status, out) == (2, "")
        assert err == "ERROR: Unable to communicate with master!\n"


def test_the_program(robot: Any, program: Start) -> None:
    out, err = program(["rosservice", "call", "/set_led_state", "data: True"]).communicate(timeout=30)
    assert (out, err) == ('success: True\nmessage: "Successfully changed LED state."\n', "")


def test_a_service_that_does_not_answer(master: str, command: Any) -> None:
    with closing(MasterProxy(master, "/ghost")) as ghost:
        ghost.register_service("/gone", "rosrpc://localhost:9", "http://localhost:9/")
    for verb in ("type", "call", "args", "info"):
        status, out, err = command("rosservice", verb, "/gone")
        # The master's information is printed nevertheless.
        assert (status, out) == (2, "Node: /ghost\nURI: rosrpc://localhost:9\n" if verb == "info" else "")
        assert err.startswith("rosservice: ERROR: service [/gone] does not answer at rosrpc://localhost:9 (")
        assert "`rosnode cleanup` forgets nodes that have ended" in err
    assert command("rosservice", "find", "std_srvs/Empty") == (0, "\n", "")


@pytest.mark.skipif(sys.platform == "win32", reason="needs a terminal of Unix")
def test_a_terminal_asks_for_missing_values(robot: Any) -> None:
    import pty

    terminal, ours = pty.openpty()
    with open(ours, closefd=True) as stdin:
        call = subprocess.Popen(
            [str(BIN / "rosservice"), "call", "/set_led_state"],
            stdin=stdin, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
    os.write(terminal, b"maybe\nTrue\n")
    out, err = call.communicate(timeout=30)
    os.close(terminal)
    assert call.returncode == 0
    assert out == "data (bool) [False]: " * 2 + 'success: True\nmessage: "Successfully changed LED state."\n'
    assert err == "rosservice: ERROR: field data is not a bool ([std_srvs/SetBoolRequest] has bool data)\n"


@pytest.mark.skipif(sys.platform == "win32", reason="needs a terminal of Unix")
def test_a_call_in_a_launch_does_not_ask(robot: Any) -> None:
    """A node shares roslaunch's terminal, whose keys are meant for other nodes."""
    terminal, ours = os.openpty()
    with open(ours, closefd=True) as stdin:
        done = subprocess.run(
            [str(BIN / "rosservice"), "call", "/set_led_state", "__log:=/tmp/call.log"],
            stdin=stdin, capture_output=True, text=True, timeout=30, check=False,
        )  # fmt: skip
    os.close(terminal)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.endswith("please specify service arguments: data\n")


def test_words_for_values_work_in_nested_headers() -> None:
    """In real rosservice, too, `auto` is a stamped header and `now` the current time."""
    from sensor_msgs.srv import SetCameraInfoRequest

    from minirospy.introspect.services import fill_request

    for values in ({"camera_info": {"header": "auto"}}, {"camera_info": {"header": {"stamp": "now"}}}):
        request = fill_request("sensor_msgs/SetCameraInfo", [values])
        assert isinstance(request, SetCameraInfoRequest)
        assert request.camera_info.header.stamp.secs > 1_000_000_000
