"""Clients of the Foxglove protocol against a bridge, with real sockets and nodes."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

from std_msgs.msg import String
from std_srvs.srv import SetBool, SetBoolResponse

if TYPE_CHECKING:
    from tests.bridge.conftest import Running


def text_of(frame: bytes) -> tuple[int, str]:
    """Return the subscription and the text of a message with a std_msgs/String."""
    opcode, subscription, _ = struct.unpack_from("<BIQ", frame)
    assert opcode == 1
    (length,) = struct.unpack_from("<I", frame, 13)
    return subscription, frame[17 : 17 + length].decode()


def test_client_is_offered_channels_and_gets_bytes_of_ros(bridge: Running) -> None:
    talker = bridge.node("talker")
    publisher = bridge.publisher(talker, "/chatter", String, latch=True)
    bridge.run(publisher.publish("hello"))
    client = bridge.client()

    info = client.next("serverInfo")
    assert info["supportedEncodings"] == ["ros1"]
    assert info["metadata"] == {"ROS_DISTRO": "noetic"}
    client.subscribe("/chatter", 7)
    assert client.channels["/chatter"] == {
        "id": client.channel("/chatter"),
        "topic": "/chatter",
        "encoding": "ros1",
        "schemaName": "std_msgs/String",
        "schema": String._full_text,
        "schemaEncoding": "ros1msg",
    }
    assert text_of(client.next_binary(1)) == (7, "hello")


def test_late_subscription_gets_every_latched_publishers_message(bridge: Running) -> None:
    for number in range(3):
        publisher = bridge.publisher(bridge.node(f"n{number}"), "/tf_static", String, latch=True)
        bridge.run(publisher.publish(f"frame {number}"))
    for subscription in (1, 2):
        client = bridge.client()
        client.subscribe("/tf_static", subscription)
        texts = {text_of(client.next_binary(1))[1] for _ in range(3)}
        assert texts == {"frame 0", "frame 1", "frame 2"}
    assert len(bridge.bridge.graph.topics) == 1


def test_topics_come_and_go(bridge: Running) -> None:
    client = bridge.client()
    client.next("advertise")
    talker = bridge.node("talker")
    publisher = bridge.publisher(talker, "/chatter", String)
    channel = client.channel("/chatter")
    client.subscribe("/chatter")
    bridge.run(publisher.close())
    assert channel in client.next("unadvertise")["channelIds"]
    bridge.publisher(talker, "/chatter", String)
    assert client.channel("/chatter") != channel


def test_client_publishes_to_ros(bridge: Running) -> None:
    listener = bridge.node("listener")

    async def subscribe() -> object:
        return await listener.subscribe("/from_client", String)

    messages = bridge.run(subscribe())
    client = bridge.client()
    channel = {"id": 5, "topic": "/from_client", "encoding": "ros1", "schemaName": "std_msgs/String"}
    client.send(op="advertise", channels=[channel])
    bridge.run(messages.wait_for_publishers())  # type: ignore[attr-defined]
    client.send_binary(struct.pack("<BII", 1, 5, 2) + b"hi")
    assert bridge.run(messages.next()).data == "hi"  # type: ignore[attr-defined]


def test_client_calls_a_service(bridge: Running) -> None:
    server = bridge.node("server")

    async def serve() -> None:
        await server.serve("/set", SetBool, lambda request: SetBoolResponse(request.data, "done"))

    bridge.run(serve())
    client = bridge.client()
    service = client.service("/set")
    client.send_binary(struct.pack("<BIII", 2, service, 9, 4) + b"ros1" + b"\x01")
    frame = client.next_binary(3)
    assert (
        frame == struct.pack("<BIII", 3, service, 9, 4) + b"ros1" + b"\x01" + struct.pack("<I", 4) + b"done"
    )
