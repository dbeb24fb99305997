"""rosbridge_websocket, rosapi_node and web_video_server as processes, and their parameters."""

from __future__ import annotations

import http.client
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from minirospy.base.errors import BridgeError
from minirospy.web.node_parameters import globs
from minirospy.web.rosbridge.node import main, options_of, refuse
from minirospy.web.video import node as video
from tests.conftest import free_port
from tests.web.conftest import RosbridgeClient

Start = Callable[..., None]


@pytest.fixture
def start(master: str) -> Iterator[Start]:
    """Return a function that starts a command and waits for a line that contains a given string."""
    started: list[subprocess.Popen[str]] = []

    def starting(text: str, *words: str) -> None:
        process = subprocess.Popen(
            [sys.executable, "-m", "minirospy", *words],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        started.append(process)
        lines: list[str] = []
        assert process.stdout
        while not any(text in line for line in lines):
            lines.append(process.stdout.readline())
            assert lines[-1], lines

    yield starting
    for process in started:
        process.terminate()
        process.communicate(timeout=60)


@pytest.mark.usefixtures("master")
def test_server_that_waits_for_its_port_ends_at_a_signal() -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        words = ("run", "rosbridge_server", "rosbridge_websocket", f"_port:={other.getsockname()[1]}")
        process = subprocess.Popen(
            [sys.executable, "-m", "minirospy", *words], stderr=subprocess.PIPE, text=True
        )
        try:
            assert process.stderr
            while "Retrying in 2s." not in process.stderr.readline():
                assert process.poll() is None
            process.send_signal(signal.SIGTERM)
            process.communicate(timeout=60)
            assert process.returncode == (1 if sys.platform == "win32" else 0)
        finally:
            process.kill()
            process.communicate()


def test_launch_file_starts_rosbridge_and_rosapi(start: Start) -> None:
    port = free_port()
    start(
        "Rosbridge WebSocket server started at ws://127.0.0.1",
        *("launch", "rosbridge_server", "rosbridge_websocket.launch", f"port:={port}"),
        *("unregister_timeout:=0.5", "topics_glob:=['/a*', '/rosout']"),
    )
    client = RosbridgeClient(port)
    client.send(op="set_level", level="warning")
    client.send(op="subscribe", topic="/b", type="std_msgs/String")
    assert client.next("status")["msg"] == "No match found for topic, cancelling subscription to: /b"
    while not (answer := client.call("/rosapi/topics"))["result"]:
        assert "does not exist" in answer["values"] or "unavailable" in answer["values"]
    assert "/rosout" in answer["values"]["topics"]
    client.close()


def test_video_server_lists_topics(start: Start) -> None:
    port = free_port()
    start("Waiting For connections on", "run", "web_video_server", "web_video_server", f"_port:={port}")
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
    connection.request("GET", "/")
    assert "Available ROS Image Topics" in connection.getresponse().read().decode()
    connection.close()


def test_parameters_become_options() -> None:
    options = options_of(
        {
            "port": 9091,
            "fragment_timeout": 5,
            "unregister_timeout": 1.5,
            "max_message_size": 1000,
            "websocket_ping_interval": 5,
            "websocket_ping_timeout": 10,
            "authenticate": True,
            "services_glob": "['/a*']",
            "websocket_null_origin": True,
        },
        {},
    )
    assert (options.rosbridge_port, options.foxglove_port, options.address) == (9091, None, "127.0.0.1")
    rosbridge = options.rosbridge
    assert (rosbridge.fragment_timeout, rosbridge.unregister_timeout, rosbridge.fragment_size) == (
        5.0,
        1.5,
        1000,
    )
    assert rosbridge.authenticate
    assert (options.limits.ping_seconds, options.limits.silent_seconds) == (5.0, 15.0)
    assert [options.filters.services(name) for name in ("/ab", "/rosapi/topics", "/b")] == [True, True, False]
    assert options.access.origins == ("null",)
    assert options_of({"max_message_size": "None"}, {}).rosbridge.fragment_size is None
    assert video.options_of({"port": 81}, {}).video_port == 81


def test_globs_are_lists_in_texts() -> None:
    assert globs({"g": "['/tf', \"/odom*\", ]"}, "g") == ["/tf", "/odom*"]
    assert [globs(each, "g") for each in ({}, {"g": "[]"}, {"g": "[*]"}, {"g": ["/a"]})] == [
        [],
        [],
        ["*"],
        ["/a"],
    ]


@pytest.mark.parametrize(
    ("private", "text"),
    [
        ({"bson_only_mode": True}, "BSON is not offered: subscribe with compression cbor"),
        ({"binary_encoder": "bson"}, "BSON is not offered"),
        ({"port": "x"}, "parameter ~port is 'x': it has to be of type int"),
        ({"fragment_timeout": "x"}, "parameter ~fragment_timeout is 'x': it has to be a number"),
        ({"max_message_size": 3}, "parameter ~max_message_size is 3"),
        ({"topics_glob": 3}, "parameter ~topics_glob is 3: it has to be a list of strings"),
    ],
)
def test_wrong_parameter_is_refused(private: dict[str, Any], text: str) -> None:
    with pytest.raises(BridgeError) as error:
        options_of(private, {})
    assert str(error.value).startswith(text)


def test_what_is_not_served_is_refused_by_name(capsys: pytest.CaptureFixture[str]) -> None:
    assert (refuse("rosbridge_tcp"), main(["--wrong", "1"]), main(["--port"])) == (1, 1, 1)
    printed = capsys.readouterr().err.splitlines()
    assert printed[0].startswith("rosbridge_tcp: ERROR: minirospy serves rosbridge over WebSocket only")
    assert printed[1].startswith("rosbridge_websocket: ERROR: --wrong is unknown: there is --port, --address")
    assert printed[2] == "rosbridge_websocket: ERROR: --port argument provided without a value"
