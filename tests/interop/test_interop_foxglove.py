"""The bridge with Foxglove's software: the apps' client library under node, and foxglove-sdk's server."""

from __future__ import annotations

import json
import os
import struct
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from std_msgs.msg import String
from std_srvs.srv import SetBool, SetBoolResponse

from tests.conftest import free_port
from tests.interop.conftest import PATIENCE
from tests.interop.test_interop_foreign import FOREIGN, modules
from tests.web.conftest import Client, Running, bridge, run_bridge

__all__ = ["bridge", "modules", "run_bridge"]


@pytest.mark.parametrize("subprotocol", ["foxglove.websocket.v1", "foxglove.sdk.v1"])
def test_client_of_the_apps_talks_to_the_bridge(bridge: Running, modules: Path, subprotocol: str) -> None:
    talker = bridge.node("talker")
    bridge.run(bridge.publisher(talker, "/latched", String, latch=True).publish("hello"))

    async def serve() -> None:
        await talker.serve("/set", SetBool, lambda request: SetBoolResponse(request.data, "ok"))

    bridge.run(serve())
    done = subprocess.run(
        ["node", str(FOREIGN / "foxglove_ws_client.js"), f"ws://127.0.0.1:{bridge.port}", subprotocol],
        env={**os.environ, "NODE_PATH": str(modules)},
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    steps = {each["step"]: each["value"] for each in map(json.loads, done.stdout.splitlines())}
    assert steps.pop("serverInfo")["distro"] == "noetic"
    assert steps.pop("message") == {
        "schema": "std_msgs/String",
        "hex": (struct.pack("<I", 5) + b"hello").hex(),
    }
    assert steps.pop("service") == (b"\1" + struct.pack("<I", 2) + b"ok").hex()
    assert steps.pop("failure") == "Service with id 9999 does not exist"
    assert steps.pop("parameters") == [{"name": "/from_node", "value": [1.5, 2], "type": "float64_array"}]
    asset = steps.pop("asset")
    assert (asset["id"], asset["status"]) == (3, 1)
    assert "no_such_package" in asset["error"]
    assert steps == {"graph": True, "published": True}


@pytest.fixture
def sdk() -> Iterator[Callable[..., Any]]:
    """Return a function that starts foxglove-sdk's server; skip the test if it is not installed."""
    foxglove = pytest.importorskip("foxglove")
    started = []

    def start(**options: Any) -> tuple[Any, int]:
        port = free_port()
        foxglove.set_log_level("ERROR")
        server = foxglove.start_server(
            host="127.0.0.1",
            port=port,
            context=options.pop("context"),
            supported_encodings=["ros1"],
            **options,
        )
        started.append(server)
        return server, port

    yield start
    for server in started:
        server.stop()


def test_frames_have_the_form_of_those_of_the_sdk(bridge: Running, sdk: Callable[..., Any]) -> None:
    """For the same topic, both servers send fields with the same names and types, and binary messages with the same header."""
    import foxglove

    context = foxglove.Context()
    _, port = sdk(context=context, capabilities=[foxglove.Capability.Time])
    schema = foxglove.Schema(name="std_msgs/String", encoding="ros1msg", data=String._full_text.encode())
    channel = foxglove.Channel("/chatter", message_encoding="ros1", schema=schema, context=context)
    publisher = bridge.publisher(bridge.node("talker"), "/chatter", String, latch=True)
    body = struct.pack("<I", 2) + b"hi"

    ours, theirs = bridge.client(), Client(port, subprotocols=("foxglove.sdk.v1",))  # type: ignore[arg-type]
    found = []
    for client in (ours, theirs):
        info = client.next("serverInfo")
        client.subscribe("/chatter", 5)
        offer = dict(client.channels["/chatter"])
        found.append(({key: type(info[key]) for key in ("op", "name", "capabilities", "sessionId")}, offer))
        offer.pop("id")
    assert found[0] == found[1]

    bridge.run(publisher.publish("hi"))
    frames = [ours.next_binary(1)]
    while len(frames) < 2:
        # Repeat until the subscription has reached the server.
        channel.log(body, log_time=7)
        try:
            theirs.socket.socket.settimeout(1.0)
            frames.append(theirs.next_binary(1))
        except TimeoutError:
            continue
    assert frames[0][:5] == frames[1][:5] == b"\x01\x05\0\0\0"
    assert frames[0][13:] == frames[1][13:] == body
    theirs.close()
