"""rosbridge clients with a bridge, with real sockets and nodes."""

from __future__ import annotations

import asyncio
import base64
import gc
import json
import struct
import threading
import time
import warnings
from collections.abc import Callable
from typing import TYPE_CHECKING, Any
from unittest.mock import Mock

import cbor2
import pytest
from actionlib_tutorials.msg import FibonacciAction
from geometry_msgs.msg import PoseStamped
from rosbridge_msgs.msg import ConnectedClients
from sensor_msgs.msg import Image, LaserScan
from std_msgs.msg import Int32, Int64MultiArray, String
from std_srvs.srv import SetBool, SetBoolResponse
from websockets.exceptions import ConnectionClosed

from minirospy import Node
from minirospy.aio.raw import raw_class
from minirospy.aio.services import Service
from minirospy.base.errors import ServiceException
from minirospy.base.name_filter import NameFilter
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.ros.actionlib.actionlib.aio import ActionServer, GoalError
from minirospy.web.access import Access
from minirospy.web.graph import Filters
from minirospy.web.rosbridge import client_actions, conversion, png, protocol, shared
from minirospy.web.rosbridge.shared import RosbridgeOptions
from minirospy.web.server.client import WebClient
from tests.waiting import until, wait_until

if TYPE_CHECKING:
    from tests.web.conftest import Running


def latched(bridge: Running, topic: str, message: Any) -> Node:
    node = bridge.node(f"node{topic.replace('/', '_')}")
    publisher = bridge.publisher(node, topic, type(message), latch=True)
    bridge.run(publisher.publish(message))
    return node


def received(
    bridge: Running, node: Node, topic: str, class_: type, count: int = 1
) -> Callable[[], list[Any]]:
    """Subscribe to a topic; return a function that waits for the messages."""

    async def subscribe() -> Any:
        return await node.subscribe(topic, class_, queue_size=100)

    subscription = bridge.run(subscribe())

    async def gather() -> list[Any]:
        return [await subscription.next(30.0) for _ in range(count)]

    return lambda: bridge.run(gather())


# --- topics


def test_latched_message_reaches_a_late_client(bridge: Running) -> None:
    latched(bridge, "/late", String("hello"))
    client = bridge.rosbridge()
    client.send(op="subscribe", topic="/late", type="std_msgs/String")
    assert client.next("publish") == {"op": "publish", "topic": "/late", "msg": {"data": "hello"}}
    other = bridge.rosbridge()
    other.send(op="subscribe", topic="/late")
    assert other.next("publish")["msg"] == {"data": "hello"}


def test_first_published_message_reaches_a_known_subscriber(bridge: Running) -> None:
    node = bridge.node("listener")
    messages = received(bridge, node, "/pose", PoseStamped, 2)
    client = bridge.rosbridge()
    client.send(op="advertise", topic="/pose", type="geometry_msgs/PoseStamped")
    for x in (1, 2.5):
        client.send(
            op="publish", topic="/pose", msg={"header": {"frame_id": "map"}, "pose": {"position": {"x": x}}}
        )
    first, second = messages()
    assert (first.pose.position.x, second.pose.position.x) == (1.0, 2.5)
    assert (first.header.seq, second.header.seq, first.header.frame_id) == (1, 2, "map")
    assert first.header.stamp.secs > 0


def test_operations_of_a_client_on_one_topic_are_limited(bridge: Running) -> None:
    client = bridge.rosbridge()
    for number in range(101):
        client.send(op="advertise", topic="/t", type="std_msgs/String", id=f"a{number}")
        client.send(op="subscribe", topic="/t", type="std_msgs/String", id=f"s{number}")
    assert client.next("status", id="a100")["msg"] == "advertise: a client may advertise a topic 100 times"
    assert client.next("status", id="s100")["msg"] == "subscribe: a client may subscribe to a topic 100 times"
    for number in range(201):
        client.send(op="advertise_service", service=f"/s{number}", type="std_srvs/Empty", id=f"v{number}")
    assert client.next("status", id="v200")["msg"] == "advertise_service: a client may offer 200 services"
    client.send(op="subscribe", topic="/" + "[" * 900_000, type="std_msgs/String", id="long")
    assert "4096 characters at most" in client.next("status", id="long")["msg"]


@pytest.mark.parametrize("encoding", ["JSON", "CBOR", "fragments"])
def test_large_messages_arrive_in_order_with_small_ones(bridge: Running, encoding: str) -> None:
    node = bridge.node("listener")
    messages = received(bridge, node, "/numbers", Int64MultiArray, 5)
    client = bridge.rosbridge()
    client.send(op="advertise", topic="/numbers", type="std_msgs/Int64MultiArray")
    for number in range(5):
        data = [number] * (100_000 if number % 2 else 1)
        fields = {"op": "publish", "topic": "/numbers", "msg": {"data": data}}
        if encoding == "CBOR":
            client.socket.send(cbor2.dumps(fields))
        elif encoding == "JSON":
            client.send(**fields)
        else:
            text = json.dumps(fields)
            for at, half in enumerate((text[:20], text[20:])):
                client.send(op="fragment", id=f"f{number}", num=at, total=2, data=half)
    assert [(each.data[0], len(each.data)) for each in messages()] == [
        (0, 1),
        (1, 100_000),
        (2, 1),
        (3, 100_000),
        (4, 1),
    ]


def test_no_client_waits_for_the_large_message_of_another(bridge: Running) -> None:
    node = bridge.node("listener")
    messages = received(bridge, node, "/numbers", Int64MultiArray)
    client = bridge.rosbridge()
    client.send(op="advertise", topic="/numbers", type="std_msgs/Int64MultiArray")
    client.synchronize()
    released = threading.Event()
    decode = protocol.decode_in_pieces

    def blocked(data: str | bytes) -> Any:
        assert released.wait(100)
        return decode(data)

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(protocol, "decode_in_pieces", blocked)
        try:
            client.send(op="publish", topic="/numbers", msg={"data": [7] * 100_000})
            client.send(op="unsubscribe", topic=1, id="behind")
            other = bridge.rosbridge()
            other.synchronize()
            # The message counts as unfinished, so the data after it is not read.
            listener = bridge.bridge.listeners["rosbridge"]
            wait_until(lambda: max(each.unfinished for each in listener.connections) > 300_000)
        finally:
            released.set()
        assert len(messages()[0].data) == 100_000
    assert "topic" in client.next("status", id="behind")["msg"]
    assert not any(each.unfinished for each in listener.connections)


@pytest.mark.parametrize(
    ("compression", "fragment_size"), [("none", None), ("none", 1000), ("png", None), ("cbor", None)]
)
def test_large_message_is_encoded_in_a_thread_while_others_are_served(
    bridge: Running, monkeypatch: pytest.MonkeyPatch, compression: str, fragment_size: int | None
) -> None:
    encode, names = shared.encode_arrival, list[str]()
    has_started, may_end = threading.Event(), threading.Event()

    def slow(topic: str, *arguments: Any) -> bytes:
        if topic == "/large":
            names.append(threading.current_thread().name)
            has_started.set()
            may_end.wait(30)
        return encode(topic, *arguments)

    monkeypatch.setattr(shared, "encode_arrival", slow)
    latched(bridge, "/large", String("a" * 100_000))
    latched(bridge, "/small", String("b"))
    fields = {"compression": compression, "fragment_size": fragment_size}
    # The clients do not read all fragments, so they do not receive a close frame.
    client, other = (bridge.rosbridge(close_timeout=0.1) for _ in range(2))
    client.send(op="subscribe", topic="/large", **fields)
    assert has_started.wait(30)
    client.send(op="subscribe", topic="/small")
    other.send(op="subscribe", topic="/small")
    assert other.next("publish")["msg"] == {"data": "b"}
    other.send(op="subscribe", topic="/large", **fields)
    client.send(op="call_service", service="/none", id="answered")
    assert client.next("service_response")["id"] == "answered"
    may_end.set()

    # The order of a client's messages is kept.
    op = "fragment" if fragment_size else "png" if compression == "png" else "publish"
    first = client.next(op)
    assert client.next("publish")["topic"] == "/small"
    if op == "publish":
        assert first["msg"] == {"data": "a" * 100_000}
    assert other.next(op)["op"] == op
    assert set(names) == {"rosbridge-encode_0"}


def test_client_may_leave_while_its_large_message_is_encoded(
    bridge: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    encode, has_started, may_end = shared.encode_arrival, threading.Event(), threading.Event()

    def slow(*arguments: Any) -> bytes:
        has_started.set()
        may_end.wait(30)
        return encode(*arguments)

    monkeypatch.setattr(shared, "encode_arrival", slow)
    latched(bridge, "/large", String("a" * 100_000))
    client = bridge.rosbridge()
    client.send(op="subscribe", topic="/large")
    assert has_started.wait(30)
    client.close()
    wait_until(lambda: not bridge.call(lambda: bridge.bridge.rosbridge.sessions))
    may_end.set()
    other = bridge.rosbridge()
    other.send(op="subscribe", topic="/large")
    assert other.next("publish")["msg"] == {"data": "a" * 100_000}


def test_large_service_calls_and_answers_are_converted_in_a_thread(bridge: Running) -> None:
    server, client = bridge.rosbridge(), bridge.rosbridge()
    server.send(op="advertise_service", service="/list", type="rosapi/Topics")
    server.send(op="set_level", level="info")
    server.synchronize()
    names: list[str] = []
    in_thread = bridge.bridge.rosbridge.shared.in_thread

    async def noting(work: Callable[[], Any]) -> Any:
        def noted() -> Any:
            names.append(threading.current_thread().name)
            return work()

        return await in_thread(noted)

    bridge.bridge.rosbridge.shared.in_thread = noting  # type: ignore[method-assign, assignment]
    client.send(op="call_service", service="/list", id="c")
    call = server.next("call_service")
    topics = [f"/topic{number}" for number in range(30_000)]
    server.send(
        op="service_response",
        service="/list",
        id=call["id"],
        values={"topics": topics, "types": []},
        result=True,
    )
    assert client.next("service_response", id="c")["values"]["topics"] == topics
    assert len(names) == 2
    assert all(name.startswith("rosbridge-large") for name in names)


@pytest.mark.parametrize(("compression", "fragment_size"), [("none", None), ("none", 50_000), ("cbor", None)])
def test_large_answer_of_a_service_is_encoded_in_a_thread(
    bridge: Running, monkeypatch: pytest.MonkeyPatch, compression: str, fragment_size: int | None
) -> None:
    encode, names = protocol.encode_messages, list[str]()

    def noted(*arguments: Any) -> list[str | bytes]:
        names.append(threading.current_thread().name)
        return encode(*arguments)

    monkeypatch.setattr(protocol, "encode_messages", noted)
    node = bridge.node("server")

    async def serve() -> None:
        node.serve(
            "/long", SetBool, lambda request: SetBoolResponse(True, "a" * (100_000 if request.data else 10))
        )

    bridge.run(serve())
    client = bridge.rosbridge()
    fields = {"compression": compression, "fragment_size": fragment_size}
    wait_until(lambda: bridge.call(lambda: bridge.bridge.graph.service_info("/long") is not None))
    client.send(op="call_service", service="/long", args=[False], id="short", **fields)
    assert client.next("service_response", id="short")["values"]["message"] == "a" * 10
    client.send(op="call_service", service="/long", args=[True], id="long", **fields)
    if fragment_size:
        parts = [client.next("fragment", id="long")["data"] for _ in range(3)]
        answer = json.loads("".join(parts))
    else:
        answer = client.next("service_response", id="long")
    assert answer["values"] == {"success": True, "message": "a" * 100_000}
    assert [name.startswith("rosbridge-encode") for name in names] == [False, True]


def test_client_without_rights_sends_nothing_large(run_bridge: Callable[..., Running]) -> None:
    access = Access(read_token="read-token-00", write_token="write-token-0", requires_token=True)
    bridge = run_bridge(access=access)
    for opening in ("read-token-00", "write-token-0"):
        client = bridge.rosbridge(path=f"/?token={opening}")
        client.send(op="subscribe", topic="/" + "a" * 60_000, id="fits")
        assert "4096 characters at most" in client.next("status", id="fits")["msg"]
        client.send(op="subscribe", topic="/" + "a" * 70_000, id="large")
        if opening == "write-token-0":
            assert "4096 characters at most" in client.next("status", id="large")["msg"]
            continue
        with pytest.raises(ConnectionClosed, match=r"1009.*65536"):
            client.next("status", id="large")
        client = bridge.rosbridge(path=f"/?token={opening}")
        client.socket.send(cbor2.dumps({"op": "subscribe", "topic": "/a", "more": [0] * 9000}))
        assert "bytes of CBOR is too large: this token is read-only" in client.next("status")["msg"]
        # A token in fragments is not accepted, either.
        client = bridge.rosbridge(path=f"/?token={opening}")
        text = json.dumps({"op": "subscribe", "topic": "/a", "more": [0] * 25_000})
        for at, half in enumerate((text[:40_000], text[40_000:])):
            client.send(op="fragment", id="f", num=at, total=2, data=half)
        assert "is too large: this token is read-only" in client.next("status")["msg"]


def test_publish_without_advertise_uses_the_topics_type(bridge: Running) -> None:
    node = bridge.node("listener")
    messages = received(bridge, node, "/known", String)
    bridge.publisher(bridge.node("other"), "/known", String)
    client = bridge.rosbridge()
    client.send(op="publish", topic="/known", msg={"data": "x"})
    assert messages() == [String("x")]
    client.send(op="publish", topic="/unknown", msg={}, id="p")
    assert client.next("status", id="p")["msg"] == (
        "publish: Cannot infer topic type for topic /unknown as it is not yet advertised"
    )


def test_compressions_carry_the_same_message(bridge: Running) -> None:
    scan = LaserScan(ranges=[1.5, float("nan")])
    latched(bridge, "/scan", scan)
    plain = bridge.rosbridge()
    plain.send(op="subscribe", topic="/scan", compression="none")
    fields = plain.next("publish")
    assert fields["msg"]["ranges"] == [1.5, None]

    picture = bridge.rosbridge()
    picture.send(op="subscribe", topic="/scan", compression="png")
    assert json.loads(png.decode(picture.next("png")["data"])) == fields

    typed = bridge.rosbridge()
    typed.send(op="subscribe", topic="/scan", compression="cbor")
    ranges = typed.next("publish")["msg"]["ranges"]
    assert (ranges.tag, ranges.value[:4]) == (85, struct.pack("<f", 1.5))

    raw = bridge.rosbridge()
    raw.send(op="subscribe", topic="/scan", compression="cbor-raw")
    message = raw.next("publish")["msg"]
    assert sorted(message) == ["bytes", "nsecs", "secs"]
    assert LaserScan().deserialize(message["bytes"]).ranges[0] == 1.5


def test_large_message_comes_in_fragments_and_goes_in_fragments(bridge: Running) -> None:
    data = bytes(range(256)) * 1200
    latched(bridge, "/image", Image(height=480, width=640, step=640, encoding="mono8", data=data))
    client = bridge.rosbridge()
    client.send(op="subscribe", topic="/image", fragment_size=100_000)
    pieces = [client.next("fragment") for _ in range(5)]
    assert [piece["num"] for piece in pieces] == [0, 1, 2, 3, 4]
    assert {piece["total"] for piece in pieces} == {5}
    fields = json.loads("".join(piece["data"] for piece in pieces))
    assert base64.b64decode(fields["msg"]["data"]) == data

    messages = received(bridge, bridge.node("listener"), "/copy", Image)
    client.send(op="advertise", topic="/copy", type="sensor_msgs/Image")
    fields["topic"] = "/copy"
    for piece in protocol.fragments(json.dumps(fields), 50_000, "copy"):
        client.socket.send(piece)
    assert messages()[0].data == data


def test_cbor_operations_are_taken(bridge: Running) -> None:
    messages = received(bridge, bridge.node("listener"), "/bytes", Image)
    client = bridge.rosbridge()
    client.socket.send(cbor2.dumps({"op": "advertise", "topic": "/bytes", "type": "sensor_msgs/Image"}))
    client.socket.send(cbor2.dumps({"op": "publish", "topic": "/bytes", "msg": {"data": b"\0\1"}}))
    assert messages()[0].data == b"\0\1"


def test_throttled_client_gets_the_newest_message(bridge: Running) -> None:
    node = bridge.node("talker")
    publisher = bridge.publisher(node, "/count", Int32)
    client = bridge.rosbridge()
    client.send(op="subscribe", topic="/count", throttle_rate=300, queue_length=1)
    bridge.run(asyncio.wait_for(publisher.wait_for_subscribers(), 30))
    start_time = time.monotonic()
    for number in range(20):
        bridge.run(publisher.publish(Int32(number)))
    found = [client.next("publish")["msg"]["data"]]
    while found[-1] != 19:
        found.append(client.next("publish")["msg"]["data"])
    # On a machine that stalls, some of the messages in between may arrive in time.
    assert found[0] == 0
    assert found == sorted(found)
    assert len(found) <= 1 + (time.monotonic() - start_time) / 0.3


def test_unsubscribe_ends_with_the_last_id(bridge: Running) -> None:
    publisher = bridge.publisher(bridge.node("talker"), "/x", String)
    client = bridge.rosbridge()
    for id_ in ("a", "b"):
        client.send(op="subscribe", topic="/x", id=id_)
    client.send(op="unsubscribe", topic="/x", id="a")
    bridge.run(asyncio.wait_for(publisher.wait_for_subscribers(), 30))
    bridge.run(publisher.publish(String("still")))
    assert client.next("publish")["msg"]["data"] == "still"
    client.send(op="unsubscribe", topic="/x", id="b")
    client.synchronize()
    assert "/x" not in bridge.call(
        lambda: [topic for topic, shared in bridge.bridge.graph.topics.items() if shared.is_wanted]
    )


def test_topic_of_an_uninstalled_type_is_decoded_by_its_text(bridge: Running) -> None:
    type_ = InterfaceType("elsewhere_msgs/Pair", "cd60a26494a087f577976f0329fa120e", "int32 a\nint32 b\n")
    from minirospy.core.idl.load import class_from_text

    made = class_from_text(type_.name, type_.definition)
    node = bridge.node("foreign")

    async def publish() -> None:
        publisher = await node.advertise("/pair", raw_class(InterfaceType.of(made)), latch=True)
        publisher.publish_raw(struct.pack("<2i", 1, 2))

    bridge.run(publish())
    client = bridge.rosbridge()
    client.send(op="subscribe", topic="/pair", type="elsewhere_msgs/Pair")
    assert client.next("publish")["msg"] == {"a": 1, "b": 2}


def test_unadvertised_topic_lasts_for_the_timeout(run_bridge: Callable[..., Running]) -> None:
    bridge = run_bridge(rosbridge=RosbridgeOptions(unregister_timeout=0.0))
    messages = received(bridge, bridge.node("listener"), "/x", String)
    client = bridge.rosbridge()
    client.send(op="advertise", topic="/x", type="std_msgs/String", id="a")
    client.send(op="publish", topic="/x", msg={"data": "x"})
    assert messages() == [String("x")]
    client.send(op="unadvertise", topic="/x", id="a")
    client.synchronize()

    async def unadvertised() -> None:
        await until(lambda: "/x" not in bridge.bridge.graph.publishers)

    bridge.run(asyncio.wait_for(unadvertised(), 30))


@pytest.mark.parametrize("first", ["advertise", "subscribe"])
def test_a_clients_first_message_reaches_its_own_subscription(bridge: Running, first: str) -> None:
    """The topic is used before, so that its publisher or its connection may still exist."""
    client = bridge.rosbridge()
    second = "subscribe" if first == "advertise" else "advertise"
    for number in range(12):
        for op in (first, second):
            client.send(op=op, topic="/own", type="std_msgs/Int32", id="a")
        client.send(op="publish", topic="/own", msg={"data": number})
        client.send(op="publish", topic="/own", msg={"data": -number})
        assert client.next("publish")["msg"] == {"data": number}
        assert client.next("publish")["msg"] == {"data": -number}
        client.send(op="unsubscribe", topic="/own", id="a")
        client.send(op="unadvertise", topic="/own", id="a")


# --- refusals


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        (
            {"op": "subscribe", "topic": "/x", "type": "nowhere_msgs/Thing"},
            "subscribe: Unable to load the manifest for package nowhere_msgs. Caused by: nowhere_msgs",
        ),
        # These are modules without a spec, and modules that are not packages.
        *(
            (
                {"op": op, "topic": "/x", "service": "/x", "type": f"{module}/Thing"},
                f"{op}: Unable to load the manifest for package {module}. Caused by: {module}",
            )
            for op in ("subscribe", "advertise", "advertise_service")
            for module in ("__main__", "__mp_main__", ".", "a.b")
        ),
        (
            {"op": "advertise", "topic": "/x", "type": "sys/Thing"},
            "advertise: Unable to import msg class Thing",
        ),
        ({"op": "subscribe", "topic": "/x", "type": "Thing"}, "subscribe: Thing is not a valid type string"),
        (
            {"op": "subscribe", "topic": "/nothing"},
            "subscribe: Cannot infer topic type for topic /nothing as it is not yet advertised",
        ),
        (
            {"op": "subscribe", "topic": "/taken", "type": "std_msgs/Int32"},
            "subscribe: Tried to register topic /taken with type std_msgs/Int32 but it is already established with "
            "type std_msgs/String",
        ),
        (
            {"op": "advertise", "topic": "/taken", "type": "std_msgs/Int32"},
            "advertise: Tried to register topic /taken with type std_msgs/Int32 but it is already established",
        ),
        (
            {"op": "advertise", "topic": "/x", "type": "nowhere_msgs/Thing"},
            "advertise: Unable to load the manifest for package",
        ),
        ({"op": "advertise", "topic": "/x y", "type": "std_msgs/String"}, "advertise: topic [/x y]: "),
        (
            {"op": "publish", "topic": "/taken", "msg": {"data": 3}},
            "publish: std_msgs/String message requires a string for field data, but got a <class 'int'>",
        ),
        (
            {"op": "service_response", "service": "/s", "id": "i", "values": {}, "result": True},
            "Service /s has not been advertised via rosbridge.",
        ),
        (
            {"op": "unadvertise_service", "service": "/s"},
            "Service /s has not been advertised via rosbridge, can't unadvertise.",
        ),
        ({"op": "jump"}, "Unknown operation: jump.  Allowed operations: "),
        (
            {"op": "advertise_service", "service": "/s", "type": "std_srvs/No"},
            "advertise_service: Unable to import srv",
        ),
    ],
)
def test_refused_operation_gets_one_status(bridge: Running, fields: dict[str, Any], text: str) -> None:
    latched(bridge, "/taken", String("x"))
    client = bridge.rosbridge()
    # By now the server has refreshed the graph.
    client.send(op="subscribe", topic="/taken")
    client.next("publish")
    client.send(**{"id": "it", **fields})
    found = client.next("status")
    assert (found["level"], found.get("id")) == ("error", fields.get("id", "it"))
    assert found["msg"].startswith(text)
    client.synchronize()


def test_value_out_of_range_is_refused(bridge: Running) -> None:
    client = bridge.rosbridge()
    client.send(op="advertise", topic="/x", type="std_msgs/Int32")
    client.send(op="publish", topic="/x", msg={"data": 1 << 40})
    assert client.next("status")["msg"].startswith("publish: ")
    client.synchronize()


def test_malformed_message_leaves_the_client_connected(bridge: Running) -> None:
    client = bridge.rosbridge()
    client.socket.send('{"op": ')
    assert client.next("status")["msg"] == 'Unable to deserialize message from client: {"op": '
    client.socket.send(b"\xff")
    assert "of CBOR" in client.next("status")["msg"]
    client.synchronize()


def test_status_level_selects_what_is_sent(bridge: Running) -> None:
    client = bridge.rosbridge()
    client.send(op="set_level", level="info")
    client.send(op="subscribe", topic="/x", type="std_msgs/String", id="s")
    assert client.next("status") == {"op": "status", "level": "info", "msg": "Subscribed to /x", "id": "s"}
    client.send(op="set_level", level="none")
    client.send(op="jump")
    client.send(op="set_level", level="error")
    client.synchronize()
    assert not [each for each in client.kept if each["op"] == "status"]


def test_globs_hide_topics_and_services(run_bridge: Callable[..., Running]) -> None:
    only = NameFilter.of(["/allowed*"])
    bridge = run_bridge(filters=Filters(topics=only, publishable=only, services=only))
    client = bridge.rosbridge()
    client.send(op="set_level", level="warning")
    for fields, text in (
        ({"op": "subscribe", "topic": "/x"}, "No match found for topic, cancelling subscription to: /x"),
        (
            {"op": "advertise", "topic": "/x", "type": "std_msgs/String"},
            "No match found for topic, cancelling advertisement of: /x",
        ),
        ({"op": "publish", "topic": "/x"}, "No match found for topic, cancelling publish to: /x"),
        (
            {"op": "call_service", "service": "/x"},
            "No match found for service, cancelling service call for: /x",
        ),
    ):
        client.send(**fields)
        assert client.next("status")["msg"] == text


def test_read_only_client_only_reads(run_bridge: Callable[..., Running]) -> None:
    access = Access(read_token="read-token", write_token="write-token", requires_token=True)
    bridge = run_bridge(access=access)
    latched(bridge, "/x", String("hello"))
    client = bridge.rosbridge(path="/?token=read-token")
    client.send(op="subscribe", topic="/x")
    assert client.next("publish")["msg"]["data"] == "hello"
    client.send(op="advertise", topic="/y", type="std_msgs/String")
    assert "this token is read-only" in client.next("status")["msg"]
    assert "this token is read-only" in client.call("/bridge/get_loggers")["values"]


# --- services


def test_service_is_called_with_a_dict_or_a_list(bridge: Running) -> None:
    async def serve() -> None:
        await node.serve("/set", SetBool, lambda request: SetBoolResponse(True, f"data is {request.data}"))

    node = bridge.node("server")
    bridge.run(serve())
    client = bridge.rosbridge()
    for args in ({"data": True}, [True]):
        assert client.call("/set", args) == {
            "op": "service_response",
            "service": "/set",
            "result": True,
            "id": "call:/set",
            "values": {"success": True, "message": "data is True"},
        }
    assert client.call("/set", compression="cbor")["values"]["message"] == "data is False"
    failed = client.call("/nothing")
    assert (failed["result"], failed["values"]) == (False, "Service /nothing does not exist")
    wrong = client.call("/set", {"data": 3})
    assert wrong["values"] == (
        "std_srvs/SetBoolRequest message requires a bool for field data, but got a <class 'int'>"
    )


def fibonacci_server(bridge: Running) -> Any:
    """Start an action server that adds the numbers up to the goal's order; it aborts orders above 20."""

    async def execute(goal: Any) -> dict[str, Any]:
        if goal.request.order > 20:
            raise GoalError("too large", {"sequence": [1]})
        await goal.publish_feedback(sequence=[0])
        if not goal.request.order:
            await asyncio.Event().wait()
        return {"sequence": [*range(goal.request.order)]}

    async def serve() -> Any:
        node = Node("actions", rosout=False)
        await node.start()
        bridge.nodes.append(node)
        server: Any = ActionServer(node, "/fibonacci", FibonacciAction, execute)
        await server
        return server

    return bridge.run(serve())


FIBONACCI = {
    "op": "send_action_goal",
    "action": "/fibonacci",
    "action_type": "actionlib_tutorials/FibonacciAction",
}


@pytest.mark.parametrize("watches", [False, True])
def test_a_goal_is_sent_and_its_result_and_feedback_come_back(bridge: Running, watches: bool) -> None:
    server = fibonacci_server(bridge)
    client = bridge.rosbridge()
    if watches:  # the node then has a subscription of any type, too
        for topic in ("result", "feedback", "status"):
            client.send(op="subscribe", topic=f"/fibonacci/{topic}")
    client.send(**FIBONACCI, id="g1", args={"order": 3}, feedback=True)
    assert client.next("action_feedback") == {
        "op": "action_feedback",
        "action": "/fibonacci",
        "values": {"sequence": [0]},
        "id": "g1",
    }
    expected = {"op": "action_result", "action": "/fibonacci", "status": 4, "result": True}
    assert client.next("action_result") == {**expected, "values": {"sequence": [0, 1, 2]}, "id": "g1"}
    names = {"action_type": "actionlib_tutorials/action/Fibonacci"}  # as in ROS 2
    client.send(**{**FIBONACCI, **names}, args=[2])
    assert client.next("action_result") == {**expected, "values": {"sequence": [0, 1]}}
    bridge.run(server.close())


def test_goals_that_are_not_reached_say_so(bridge: Running) -> None:
    server = fibonacci_server(bridge)
    client = bridge.rosbridge()
    client.send(**FIBONACCI, id="a", args={"order": 21})
    found = client.next("action_result")
    assert (found["status"], found["values"], found["result"]) == (6, {"sequence": [1]}, True)
    client.send(**FIBONACCI, id="b", args={"order": 0}, feedback=True)
    client.next("action_feedback")
    client.send(op="cancel_action_goal", action="/fibonacci", id="b")
    client.send(**FIBONACCI, id="f", args={"order": 0})
    client.send(op="cancel_action_goal", action="/fibonacci", id="f")  # before it is sent
    client.send(**FIBONACCI, id="c", args={"order": "x"})
    client.send(**{**FIBONACCI, "action_type": "std_msgs/String"}, id="d")
    client.send(**{**FIBONACCI, "action_type": "nowhere/NoAction"}, id="e")
    results = {each["id"]: each for each in (client.next("action_result") for _ in range(5))}
    assert results["b"]["status"] == results["f"]["status"] == 5
    assert "requires a int32 for field order" in results["c"]["values"]
    assert "is not installed" in results["d"]["values"]
    assert "nowhere" in results["e"]["values"]
    bridge.run(server.close())


def test_a_goal_without_a_server_ends(bridge: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(client_actions, "SERVER_SECONDS", 0.2)
    client = bridge.rosbridge()
    client.send(**FIBONACCI, id="a", args={"order": 1})
    found = client.next("action_result")
    assert (found["result"], found["status"], found["id"]) == (False, 0, "a")
    assert "action server /fibonacci" in found["values"]


def test_a_goal_of_another_type_than_the_servers_blocks_nobody(bridge: Running) -> None:
    server = fibonacci_server(bridge)
    bridge.run(bridge.bridge.rosbridge.shared.graph.look())
    wrong, right = bridge.rosbridge(), bridge.rosbridge()
    wrong.send(**{**FIBONACCI, "action_type": "actionlib/TestAction"}, args={"goal": 1})
    assert wrong.next("action_result")["values"] == (
        "Tried to register topic /fibonacci/result with type actionlib/TestActionResult but it is already established "
        "with type actionlib_tutorials/FibonacciActionResult"
    )
    right.send(**FIBONACCI, args={"order": 2})
    assert right.next("action_result")["values"] == {"sequence": [0, 1]}
    bridge.run(server.close())


def test_a_goal_of_another_type_than_a_waiting_goal_is_refused(bridge: Running) -> None:
    graph = bridge.bridge.rosbridge.shared.graph
    bridge.rosbridge().send(**FIBONACCI, args={"order": 1})

    async def is_published() -> bool:
        await graph.look()
        return "/fibonacci/goal" in graph.snapshot.publishers

    bridge.run(until(is_published))
    client = bridge.rosbridge()
    client.send(**{**FIBONACCI, "action_type": "actionlib/TestAction"}, args={"goal": 1})
    assert client.next("action_result")["values"] == (
        "/bridge publishes /fibonacci/goal as actionlib_tutorials/FibonacciActionGoal already"
    )


def test_an_action_has_no_type_after_a_goal_without_a_server(
    bridge: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(client_actions, "SERVER_SECONDS", 0.2)
    wrong, right = bridge.rosbridge(), bridge.rosbridge()
    wrong.send(**{**FIBONACCI, "action_type": "actionlib/TestAction"}, args={"goal": 1})
    assert "timeout exceeded" in wrong.next("action_result")["values"]
    right.send(**FIBONACCI, args={"order": 1})
    assert "timeout exceeded" in right.next("action_result")["values"]


def test_a_goal_cancelled_before_a_server_is_there_ends_at_once(
    bridge: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(client_actions, "SERVER_SECONDS", 3600.0)
    client = bridge.rosbridge()
    client.send(**FIBONACCI, id="a", args={"order": 1})
    client.send(op="cancel_action_goal", action="/fibonacci", id="a")
    found = client.next("action_result")
    assert (found["result"], found["status"]) == (False, 5)
    assert found["values"] == "the goal was recalled: cancelled before a server was there"


TRANSFORMS = {
    "op": "send_action_goal",
    "action": "/transforms",
    "action_type": "tf2_web_republisher/TFSubscriptionAction",
}


def test_memory_of_a_goal_is_counted_until_it_ends(bridge: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    held: list[int] = []
    monkeypatch.setattr(WebClient, "holds", lambda _, count: held.append(count))
    client = bridge.rosbridge()
    client.send(**TRANSFORMS, id="a", args={"target_frame": "a" * 10_000})
    client.synchronize()
    assert max(held, default=0) > 10_000
    client.send(op="cancel_action_goal", action="/transforms", id="a")
    client.next("action_result")
    bridge.run(until(lambda: held[-1] == 0))


def test_large_goal_is_converted_in_a_thread(bridge: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(client_actions, "SERVER_SECONDS", 0.2)
    threads: list[str] = []
    fill = conversion.fill

    def noting(*words: Any) -> None:
        threads.append(threading.current_thread().name)
        fill(*words)

    monkeypatch.setattr(conversion, "fill", noting)
    client = bridge.rosbridge()
    client.send(**TRANSFORMS, args={"source_frames": [f"frame{number}" for number in range(30_000)]})
    client.next("action_result")
    assert len(threads) == 1
    assert threads[0].startswith("rosbridge-large")


@pytest.mark.parametrize("compression", ["none", "cbor"])
def test_slow_client_gets_the_newest_feedback_alone(
    bridge: Running, monkeypatch: pytest.MonkeyPatch, compression: str
) -> None:
    streamed: list[tuple[object, bool]] = []

    def noting(_: object, key: object, *_data: object, newest_only: bool = False) -> None:
        streamed.append((key, newest_only))

    for name in ("send_texts", "send_message"):
        monkeypatch.setattr(WebClient, name, noting)
    server = fibonacci_server(bridge)
    client = bridge.rosbridge()
    client.send(**FIBONACCI, args={"order": 2}, feedback=True, compression=compression)
    client.next("action_result")
    assert len(streamed) == 1
    assert streamed[0][1]
    bridge.run(server.close())


def test_a_reader_sends_no_goals(run_bridge: Callable[..., Running]) -> None:
    bridge = run_bridge(access=Access(default_is_read=True))
    client = bridge.rosbridge()
    client.send(**FIBONACCI, args={"order": 1})
    assert client.next("action_result")["values"] == "sending goals is not allowed: this token is read-only"


def test_nanoseconds_above_a_second_are_carried(bridge: Running) -> None:
    messages = received(bridge, bridge.node("listener"), "/pose", PoseStamped)
    client = bridge.rosbridge()
    client.send(op="advertise", topic="/pose", type="geometry_msgs/PoseStamped")
    stamp = {"secs": 5, "nsecs": 1_500_000_000}
    client.send(op="publish", topic="/pose", msg={"header": {"stamp": stamp}})
    [message] = messages()
    assert (message.header.stamp.secs, message.header.stamp.nsecs) == (6, 500_000_000)


def test_client_offers_a_service(bridge: Running) -> None:
    client = bridge.rosbridge()
    client.send(op="set_level", level="info")
    client.send(op="advertise_service", service="/ours", type="std_srvs/SetBool")
    assert client.next("status")["msg"] == "Advertised service /ours."
    node = bridge.node("caller")

    def answer(fields: dict[str, Any]) -> Any:
        async def call() -> asyncio.Task[Any]:
            await node.wait_for_service("/ours", 30)
            return asyncio.ensure_future(node.call("/ours", SetBool, True))

        task = bridge.run(call())
        request = client.next("call_service")
        assert (request["service"], request["args"]) == ("/ours", {"data": True})
        client.send(op="service_response", service="/ours", id=request["id"], **fields)

        async def wait() -> Any:
            return await task

        return bridge.run(wait())

    response = answer({"values": {"success": True, "message": "done"}, "result": True})
    assert (response.success, response.message) == (True, "done")
    with pytest.raises(ServiceException, match="it is broken"):
        answer({"values": "it is broken", "result": False})
    with pytest.raises(ServiceException, match="does not have a field nothing"):
        answer({"values": {"nothing": 1}, "result": True})

    client.send(op="unadvertise_service", service="/ours")
    assert client.next("status", level="info")["msg"] == "Unadvertised service /ours."


def test_service_of_a_client_that_has_left_is_offered_by_another(
    bridge: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    closing, may_close = asyncio.Event(), asyncio.Event()
    close = Service.close

    async def close_late(self: Service) -> None:
        closing.set()
        await may_close.wait()
        await close(self)

    monkeypatch.setattr(Service, "close", close_late)
    first, second = bridge.rosbridge(), bridge.rosbridge()
    offer = {"op": "advertise_service", "service": "/ours", "type": "std_srvs/SetBool"}
    for client in (first, second):
        client.send(op="set_level", level="info")
        client.synchronize()
    first.send(**offer)
    assert first.next("status")["msg"] == "Advertised service /ours."
    first.close()
    bridge.run(closing.wait())  # type: ignore[arg-type]

    (connection,) = bridge.bridge.listeners["rosbridge"].connections
    second.send(**offer)
    wait_until(lambda: bridge.call(lambda: connection.traffic.received) == 3)
    bridge.call(may_close.set)
    assert second.next("status")["msg"] == "Advertised service /ours."


def test_call_fails_when_the_offering_client_leaves(bridge: Running) -> None:
    client = bridge.rosbridge()
    client.send(op="advertise_service", service="/ours", type="std_srvs/SetBool")
    node = bridge.node("caller")

    async def call() -> asyncio.Task[Any]:
        await node.wait_for_service("/ours", 30)
        return asyncio.ensure_future(node.call("/ours", SetBool, True))

    task = bridge.run(call())
    client.next("call_service")
    client.close()

    async def wait() -> Any:
        return await task

    with pytest.raises(ServiceException, match="has disconnected"):
        bridge.run(wait())


# --- authentication


def test_client_has_to_authenticate_first(run_bridge: Callable[..., Running]) -> None:
    from rosauth.srv import Authentication

    bridge = run_bridge(rosbridge=RosbridgeOptions(authenticate=True))
    node = bridge.node("auth")

    async def serve() -> None:
        await node.serve("/authenticate", Authentication, lambda request: request.mac == "right")

    bridge.run(serve())
    fields = {"client": "c", "dest": "d", "rand": "r", "t": 1, "level": "l", "end": 2}
    client = bridge.rosbridge()
    client.send(op="auth", mac="right", **fields)
    client.synchronize()
    for first in ({"op": "auth", "mac": "wrong", **fields}, {"op": "subscribe", "topic": "/x"}):
        refused = bridge.rosbridge()
        refused.send(**first)
        with pytest.raises(ConnectionClosed):
            refused.next("publish")


def test_clients_are_published_as_by_rosbridge_server(bridge: Running) -> None:
    node = bridge.node("watcher")

    async def subscribe() -> tuple[Any, ...]:
        return tuple(
            node.subscribe(topic, class_, queue_size=100)
            for topic, class_ in (("/client_count", Int32), ("/connected_clients", ConnectedClients))
        )

    counts, lists = bridge.run(subscribe())
    assert bridge.run(counts.next(30)).data == 0
    assert bridge.run(lists.next(30)).clients == []
    client = bridge.rosbridge()
    assert bridge.run(counts.next(30)).data == 1
    (found,) = bridge.run(lists.next(30)).clients
    assert found.ip_address == "127.0.0.1"
    assert found.connection_time.secs > 0
    client.close()
    assert bridge.run(counts.next(30)).data == 0
    assert bridge.run(lists.next(30)).clients == []


def test_operation_of_a_client_that_has_left_is_never_started(bridge: Running) -> None:
    """The client disconnects in the same loop iteration in which its message arrives."""

    def leave() -> None:
        client = Mock(may_write=True)
        client.name = "test"
        session = bridge.bridge.rosbridge.open(client)
        session.received_text('{"op": "publish", "topic": "/unknown", "msg": {}}')
        session.ended()

    async def settle() -> None:
        await asyncio.gather(*bridge.bridge.graph.tasks, return_exceptions=True)

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        bridge.call(leave)
        bridge.run(settle())
        gc.collect()
    assert not [each for each in caught if "never awaited" in str(each.message)]
