"""The ROS 2 bridge with a fake backend in place of rclpy: opening, closing and forwarding; its pure parts; the command."""

from __future__ import annotations

import asyncio
import socket
import struct
import sys
import threading
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any, cast

import pytest

from minirospy import Node
from minirospy.aio.raw import raw_class
from minirospy.base.errors import BridgeError, DeserializationError
from minirospy.base.name_filter import NameFilter
from minirospy.cli.ros2_bridge import main
from minirospy.core.idl.load import message_class
from minirospy.core.tf2.statics import StaticTransforms
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.introspect.snapshot import Snapshot, fetch
from minirospy.ros2.bridge import Ros2Bridge, Ros2Options, TopicPassing
from minirospy.ros2.interface import Accept, Ros2Goal
from minirospy.ros2.layouts import TypesDiffer
from minirospy.ros2.link_table import Pair
from minirospy.ros2.links import BRIDGE_PREFIX, Direction, Link, Ros2End, Ros2Topic, links, marker
from minirospy.ros2.parameter_values import Value
from minirospy.ros2.rclpy_parameters import ParameterStore
from minirospy.ros2.rules import BUILT_IN, Rules, parse_rules, snake_case
from minirospy.ros2.side import large_message_settings
from tests.ros2.ros2_definitions import catalogue
from tests.waiting import until

STRING = Ros2End("/peer", "std_msgs/String")


def links_of(ros1: Snapshot, ros2: Mapping[str, Ros2Topic], latched: bool = False) -> list[Link]:
    return links(ros1, ros2, lambda *_: latched, BUILT_IN.ros1_message)


def snapshot(
    publishers: tuple[str, ...] = (), subscribers: tuple[str, ...] = (), type_: str = "std_msgs/String"
) -> Snapshot:
    return Snapshot(
        {"/t": publishers} if publishers else {},
        {"/t": subscribers} if subscribers else {},
        {},
        {"/t": type_} if type_ else {},
    )


# --- links


def test_a_topic_with_an_end_on_each_side_is_linked() -> None:
    to_ros2 = Link("/t", Direction.TO_ROS2, "std_msgs/String", "std_msgs/String")
    to_ros1 = Link("/t", Direction.TO_ROS1, "std_msgs/String", "std_msgs/String")
    readers, writers = Ros2Topic(subscribers=(STRING,)), Ros2Topic(publishers=(STRING,))
    assert links_of(snapshot(("/a",)), {"/t": readers}) == [to_ros2]
    assert links_of(snapshot((), ("/a",)), {"/t": writers}) == [to_ros1]
    assert links_of(snapshot(("/a",), ("/a",)), {"/t": Ros2Topic((STRING,), (STRING,))}) == [to_ros2, to_ros1]
    assert links_of(snapshot(("/a",)), {"/t": writers}) == []
    assert links_of(snapshot(("/a",)), {"/other": readers}) == []


def test_ends_of_bridges_do_not_count() -> None:
    own = Ros2End(BRIDGE_PREFIX, "std_msgs/String")
    assert links_of(snapshot(("/a",)), {"/t": Ros2Topic(subscribers=(own,))}) == []
    assert (
        links_of(
            snapshot((f"/{BRIDGE_PREFIX}",), (f"/{BRIDGE_PREFIX}",)), {"/t": Ros2Topic((STRING,), (STRING,))}
        )
        == []
    )


def test_a_subscriber_of_any_type_gets_the_type_of_ros2() -> None:
    log = Ros2Topic(publishers=(Ros2End("/n", "rcl_interfaces/Log"),))
    (link,) = links_of(snapshot((), ("/echo",), ""), {"/t": log})
    assert (link.ros1_type, link.ros2_type) == ("rosgraph_msgs/Log", "rcl_interfaces/Log")


def test_quality_of_service_follows_the_ends() -> None:
    best_effort = Ros2End("/camera", "std_msgs/String", is_reliable=False)
    keeps = Ros2End("/map", "std_msgs/String", is_transient_local=True)
    (link,) = links_of(snapshot((), ("/a",)), {"/t": Ros2Topic((best_effort, STRING))})
    assert not link.is_reliable
    (link,) = links_of(snapshot((), ("/a",)), {"/t": Ros2Topic((keeps,))})
    assert link.is_latched
    (link,) = links_of(snapshot((), ("/a",)), {"/t": Ros2Topic((keeps, STRING))})
    assert not link.is_latched
    (link,) = links_of(snapshot(("/a",)), {"/t": Ros2Topic(subscribers=(STRING, keeps))})
    assert link.is_latched
    (link,) = links_of(snapshot(("/a",)), {"/t": Ros2Topic(subscribers=(STRING,))}, latched=True)
    assert link.is_latched


def test_the_marker_leaves_the_bits_of_xcdr2_alone() -> None:
    headers = {marker(f"run {number}") for number in range(1000)}
    assert len(headers) > 900
    for header in headers:
        assert header[:2] == b"\0\1"
        assert header[2:] != b"\0\0"
        assert header[3] & 3 == 0


# --- rules


def test_rules_of_ros1_bridge_are_read() -> None:
    text = """
- ros1_package_name: old_msgs
  ros1_message_name: Speed
  ros2_package_name: new_msgs
  ros2_message_name: Velocity
  fields_1_to_2:
    Value: value
- ros1_package_name: old_msgs
  ros1_service_name: Add
  ros2_package_name: new_msgs
  ros2_service_name: Sum
  request_fields_1_to_2: {A: a}
"""
    rules = BUILT_IN.with_(parse_rules(text, "rules.yaml"))
    assert rules.ros2_messages("old_msgs/Speed") == ("new_msgs/Velocity",)
    assert rules.ros1_message("new_msgs/Velocity") == "old_msgs/Speed"
    assert rules.ros2_services("old_msgs/Add") == ("new_msgs/Sum",)
    assert rules.ros1_services("new_msgs/Sum") == ("new_msgs/Sum", "old_msgs/Add")
    assert rules.message("old_msgs/Speed").fields == {"Value": "value"}
    assert rules.message("old_msgs/AddRequest").fields == {"A": "a"}
    assert rules.ros2_messages("std_msgs/String") == ("std_msgs/String",)
    assert rules.ros1_message("tf2_msgs/TFMessage") == "tf2_msgs/TFMessage"
    assert parse_rules("", "empty.yaml") == Rules()


NAMES = "- {ros1_package_name: a, ros1_message_name: B, ros2_package_name: c, ros2_message_name: D"


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("[", "is not YAML: "),
        ("a: b", "is not a list of rules: start each with '- ros1_package_name: ...'"),
        ("- x", "rule 1: is not a mapping such as 'ros1_package_name: my_msgs'"),
        ("- {nonsense: 1}", "rule 1: has an unknown key [nonsense]"),
        ("- {ros1_package_name: a, ros2_package_name: b}", "rule 1: names neither a message nor a service"),
        ("- {ros1_message_name: B}", "rule 1: ros1_package_name is missing, or not a name"),
        (NAMES + ", fields_1_to_2: [x]}", "rule 1: fields_1_to_2 is not a mapping of fields, 'ros1_name: ros2_name'"),
        (NAMES + ", fields_1_to_2: {a.b: c}}", "rule 1: fields_1_to_2: [a.b] is not the name of a field"),
        (NAMES + ", fields_1_to_2: {a: c, b: c}}", "rule 1: fields_1_to_2: two fields become [c]"),
    ],
)  # fmt: skip
def test_bad_rules_name_the_place(text: str, error: str) -> None:
    with pytest.raises(BridgeError) as caught:
        parse_rules(text, "rules.yaml")
    assert str(caught.value).startswith("rules.yaml: " + error)


def test_field_names_become_those_of_ros2() -> None:
    assert [snake_case(each) for each in ("seqNumber", "HTTPCode", "already_so", "K")] == [
        "seq_number", "http_code", "already_so", "k",
    ]  # fmt: skip


# --- static transforms


def transforms(*children: str, number: float = 0.0) -> bytes:
    made = message_class("tf2_msgs/TFMessage")()
    for child in children:
        one: Any = message_class("geometry_msgs/TransformStamped")(child_frame_id=child)
        one.transform.translation.x = number
        made.transforms.append(one)
    return data_of(made)


def data_of(message: Any) -> bytes:
    buffer = BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def test_static_transforms_of_many_publishers_become_one_message() -> None:
    statics = StaticTransforms()
    statics.merged(transforms("a", "b"))
    statics.merged(transforms("c"))
    found: Any = message_class("tf2_msgs/TFMessage")().deserialize(
        statics.merged(transforms("b", number=5.0))
    )
    assert [(each.child_frame_id, each.transform.translation.x) for each in found.transforms] == [
        ("a", 0.0), ("b", 5.0), ("c", 0.0),
    ]  # fmt: skip


@pytest.mark.parametrize("cut", [2, 10, 25, 60])
def test_transforms_that_end_too_early_are_refused(cut: int) -> None:
    with pytest.raises(DeserializationError, match="ends too early"):
        StaticTransforms().merged(transforms("abc")[:cut])


# --- the bridge


@dataclass
class FakePublisher:
    latched: bool
    sent: list[bytes] = field(default_factory=list)
    arrived: asyncio.Event = field(default_factory=asyncio.Event)
    is_closed: bool = False
    subscribers: int = 1

    def publish(self, data: bytes) -> None:
        self.sent.append(data)
        self.arrived.set()

    def close(self) -> None:
        self.is_closed = True


@dataclass
class FakeSubscription:
    deliver: Callable[[bytes], None]
    is_closed: bool = False

    def close(self) -> None:
        self.is_closed = True


@dataclass
class FakeProbe:
    """No-op requests, which are answered while ``answers`` is true."""

    answers: bool = True
    is_ready: bool = True
    reaching: list[Future[None]] = field(default_factory=list)
    closed: int = 0

    def reach(self) -> Future[None]:
        self.reaching.append(Future())
        if self.answers:
            self.reaching[-1].set_result(None)
        return self.reaching[-1]

    def close(self) -> None:
        self.closed += 1


@dataclass
class FakeReachable:
    """A client of ``servers``. If these can lose responses, ``prober`` reaches them; otherwise it is None."""

    is_ready: bool = True
    servers: frozenset[bytes] | None = frozenset({b"1"})
    prober: FakeProbe | None = field(default_factory=FakeProbe)

    def probe(self) -> FakeProbe | None:
        return self.prober


@dataclass
class FakeClient(FakeReachable):
    """A client whose server responds with ``response``, or never."""

    response: bytes | None = None
    requests: list[bytes] = field(default_factory=list)
    is_closed: bool = False

    def call(self, request: bytes) -> Future[bytes]:
        self.requests.append(request)
        answered: Future[bytes] = Future()
        if self.response is not None:
            answered.set_result(self.response)
        return answered

    def close(self) -> None:
        self.is_closed = True


@dataclass
class FakeServer:
    answer: Callable[[bytes], Future[bytes]]
    is_closed: bool = False

    def close(self) -> None:
        self.is_closed = True


@dataclass
class FakeGoal:
    ended: Future[tuple[int, bytes]] = field(default_factory=Future)
    is_cancelled: bool = False

    def cancel(self) -> None:
        self.is_cancelled = True

    def result(self) -> Future[tuple[int, bytes]]:
        return self.ended


@dataclass
class FakeActionClient(FakeReachable):
    """A client whose server accepts or rejects each goal."""

    accepts: bool = True
    goals: list[tuple[bytes, Callable[[bytes], None], FakeGoal]] = field(default_factory=list)
    is_closed: bool = False

    def send(self, goal: bytes, feedback: Callable[[bytes], None]) -> Future[Ros2Goal | None]:
        self.goals.append((goal, feedback, FakeGoal()))
        accepted: Future[Ros2Goal | None] = Future()
        accepted.set_result(self.goals[-1][2] if self.accepts else None)
        return accepted

    def close(self) -> None:
        self.is_closed = True


@dataclass
class FakeActionServer:
    accept: Accept
    is_closed: bool = False
    closing: int = 0
    may_close: threading.Event = field(default_factory=threading.Event)  # closing blocks until this is set

    def __post_init__(self) -> None:
        self.may_close.set()

    def close(self) -> None:
        self.closing += 1
        assert self.may_close.wait(20)
        self.is_closed = True


class FakeParameters:
    """The parameters of one node."""

    def __init__(self) -> None:
        self.values: dict[str, Value] = {}

    def names(self, node: str) -> list[str]:
        return list(self.values)

    def get(self, node: str, name: str) -> Value:
        return self.values.get(name, Value(0))

    def set(self, node: str, name: str, value: Value) -> None:
        self.values[name] = value


class FakeSide:
    """A fake ROS 2 that the test controls."""

    domain = "0"
    has_found_client = True  # set if a server's responses reach its clients

    def __init__(self) -> None:
        self.graph: dict[str, Ros2Topic] = {}
        self.publishers: dict[str, FakePublisher] = {}
        self.subscriptions: dict[str, FakeSubscription] = {}
        self.offered: dict[str, str] = {}
        self.clients: dict[str, FakeClient] = {}
        self.servers: dict[str, FakeServer] = {}
        self.action_clients: dict[str, FakeActionClient] = {}
        self.action_servers: dict[str, FakeActionServer] = {}
        self.parameters = FakeParameters()
        self.is_closed = False

    def topics(self) -> Mapping[str, tuple[str, ...]]:
        return dict.fromkeys(self.graph, ())

    def ends(self, topic: str) -> Ros2Topic:
        return self.graph[topic]

    def fields(self, type_: str) -> dict[str, str]:
        known = {"std_msgs/String": {"data": "string"}, "std_msgs/Int8": {"data": "int8"}}
        if type_ not in known:
            raise TypesDiffer(f"[{type_}] is not installed in ROS 2")
        return known[type_]

    def publisher(self, topic: str, type_: str, *, depth: int, is_latched: bool) -> FakePublisher:
        self.publishers[topic] = FakePublisher(is_latched)
        return self.publishers[topic]

    def subscribe(
        self, topic: str, type_: str, deliver: Callable[[bytes], None], **_: object
    ) -> FakeSubscription:
        self.subscriptions[topic] = FakeSubscription(deliver)
        return self.subscriptions[topic]

    def nodes(self) -> list[tuple[str, str]]:
        return [("peer", "/")]

    def services(self) -> Mapping[str, str]:
        return self.offered

    def service_fields(self, type_: str) -> tuple[dict[str, str], dict[str, str]]:
        known = {
            "std_srvs/SetBool": ({"data": "boolean"}, {"success": "boolean", "message": "string"}),
            "example_interfaces/AddTwoInts": ({"a": "int64", "b": "int64"}, {"sum": "int64"}),
        }
        if type_ not in known:
            raise TypesDiffer(f"the service type [{type_}] is not installed in ROS 2")
        return known[type_]

    def client(self, service: str, type_: str) -> FakeClient:
        self.clients[service] = FakeClient(prober=FakeProbe(self.has_found_client))
        return self.clients[service]

    def serve(self, service: str, type_: str, answer: Callable[[bytes], Future[bytes]]) -> FakeServer:
        self.servers[service] = FakeServer(answer)
        return self.servers[service]

    def action_fields(self, type_: str) -> tuple[dict[str, str], dict[str, str], dict[str, str]]:
        if type_ != "example_interfaces/Fibonacci":
            raise TypesDiffer(f"the action type [{type_}] is not installed in ROS 2")
        sequence = {"sequence": "sequence<int32>"}
        return {"order": "int32"}, sequence, sequence

    def action_client(self, action: str, type_: str) -> FakeActionClient:
        self.action_clients[action] = FakeActionClient(prober=FakeProbe(self.has_found_client))
        return self.action_clients[action]

    def action_server(self, action: str, type_: str, accept: Accept) -> FakeActionServer:
        self.action_servers[action] = FakeActionServer(accept)
        return self.action_servers[action]

    def serve_parameters(self, store: ParameterStore, loop: asyncio.AbstractEventLoop) -> FakeServer:
        self.store = store
        return FakeServer(lambda _: Future())

    def node_parameters(self) -> FakeParameters:
        return self.parameters

    def close(self) -> None:
        self.is_closed = True


def bridged(scene: Callable[[Node, FakeSide, Ros2Bridge], Any], topics: NameFilter | None = None) -> FakeSide:
    """Run a scene with a node, the fake ROS 2, and a bridge that refreshes when the scene requests it."""
    side = FakeSide()

    async def run() -> None:
        async with Node("other", rosout=False) as node, Node(BRIDGE_PREFIX, rosout=False) as own:
            bridge = Ros2Bridge(own, side, Ros2Options(topics or NameFilter()), catalogue())
            try:
                await scene(node, side, bridge)
            finally:
                await bridge.close()

    asyncio.run(run())
    assert side.is_closed
    return side


async def connected(bridge: Ros2Bridge, count: int = 1) -> None:
    """Wait until the bridge's subscriptions have ``count`` publishers. Each refresh also connects and disconnects again."""

    def found() -> int:
        return sum(len(each._subscription.headers) for each in bridge.topics.links.values())

    await until(lambda: found() >= count)


def raw(name: str) -> Any:
    return raw_class(InterfaceType.of(message_class(name)))


@pytest.mark.usefixtures("master")
def test_messages_pass_to_ros2_while_it_has_a_subscriber() -> None:
    async def scene(node: Node, side: FakeSide, bridge: Ros2Bridge) -> None:
        publisher = await node.advertise("/chatter", raw("std_msgs/String"))
        assert not await bridge.look()
        side.graph["/chatter"] = Ros2Topic(subscribers=(STRING,))
        assert await bridge.look()
        assert not await bridge.look()
        await connected(bridge)
        publisher.publish_raw(b"\2\0\0\0ab")
        there = side.publishers["/chatter"]
        await there.arrived.wait()
        assert there.sent == [bridge.header + b"\3\0\0\0ab\0"]
        assert not there.latched
        side.graph.clear()
        assert await bridge.look()
        assert there.is_closed

    bridged(scene)


@pytest.mark.usefixtures("master")
def test_a_latched_topic_stays_so_for_ros2() -> None:
    async def scene(node: Node, side: FakeSide, bridge: Ros2Bridge) -> None:
        publisher = await node.advertise("/map", raw("std_msgs/String"), latch=True)
        publisher.publish_raw(b"\1\0\0\0a")
        side.graph["/map"] = Ros2Topic(subscribers=(STRING,))
        await bridge.look()
        there = side.publishers["/map"]
        await there.arrived.wait()
        assert there.latched
        assert [each[4:] for each in there.sent] == [b"\2\0\0\0a\0"]

    bridged(scene)


@pytest.mark.usefixtures("master")
def test_messages_pass_to_ros1_but_not_those_that_came_from_it() -> None:
    async def scene(node: Node, side: FakeSide, bridge: Ros2Bridge) -> None:
        came: asyncio.Queue[bytes] = asyncio.Queue()
        subscription = await node.subscribe_raw("/back", lambda frame, _: came.put_nowait(bytes(frame)))
        side.graph["/back"] = Ros2Topic(
            publishers=(Ros2End("/peer", "std_msgs/String", is_transient_local=True),)
        )
        await bridge.look()
        there = side.subscriptions["/back"]
        there.deliver(bridge.header + b"\2\0\0\0a\0")
        there.deliver(b"\0\1\0\0\2")
        there.deliver(b"\0\1\0\0\2\0\0\0b\0")
        assert await came.get() == b"\1\0\0\0b"
        assert came.empty()
        # A later subscriber receives the last message.
        async with Node("late", rosout=False) as late:
            other = await late.subscribe_raw("/back", lambda frame, _: came.put_nowait(bytes(frame)))
            assert await came.get() == b"\1\0\0\0b"
            await other.close()
        await subscription.close()

    side = bridged(scene)
    assert side.subscriptions["/back"].is_closed


@pytest.mark.usefixtures("master")
def test_messages_from_ros2_are_not_sent_back() -> None:
    async def scene(node: Node, side: FakeSide, bridge: Ros2Bridge) -> None:
        # Another bridge to the same domain would publish in this way.
        other = await node.advertise("/t", raw("std_msgs/Int8"), headers={"ros2_domain": "0"})
        side.graph["/t"] = Ros2Topic(subscribers=(Ros2End("/peer", "std_msgs/Int8"),))
        await bridge.look()
        async with Node("third", rosout=False) as third:
            mine = await third.advertise("/t", raw("std_msgs/Int8"))
            await connected(bridge, 2)
            other.publish_raw(b"\1")
            mine.publish_raw(b"\2")
            there = side.publishers["/t"]
            await there.arrived.wait()
            assert [each[4:] for each in there.sent] == [b"\2"]

    bridged(scene)


@pytest.mark.usefixtures("master")
def test_publishers_that_do_not_answer_keep_no_topic_waiting(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("minirospy.ros2.bridge.QUERY_SECONDS", 0.1)

    async def scene(node: Node, side: FakeSide, bridge: Ros2Bridge) -> None:
        topics = [f"/dead{number}" for number in range(40)]
        with socket.create_server(("127.0.0.1", 0), backlog=200) as silent:
            uri = f"http://127.0.0.1:{silent.getsockname()[1]}/"
            async with Node("dead", rosout=False) as dead:
                for topic in topics:
                    await dead.call_master("registerPublisher", topic, "std_msgs/String", uri)
            await node.advertise("/live", raw("std_msgs/String"))
            side.graph = {topic: Ros2Topic(subscribers=(STRING,)) for topic in [*topics, "/live"]}
            await asyncio.wait_for(bridge.look(), 60.0)
            assert side.publishers.keys() == {*topics, "/live"}

    bridged(scene)


@pytest.mark.usefixtures("master")
def test_types_that_do_not_map_are_listed_with_the_reason() -> None:
    async def scene(node: Node, side: FakeSide, bridge: Ros2Bridge) -> None:
        await node.advertise("/a", raw("std_msgs/String"))
        await node.advertise("/b", raw("std_msgs/Int16"))
        await node.advertise("/hidden", raw("std_msgs/Int16"))
        side.graph = {topic: Ros2Topic(subscribers=(STRING,)) for topic in ("/a", "/b", "/hidden")}
        assert await bridge.pairs() == [
            Pair(Link("/a", Direction.TO_ROS2, "std_msgs/String", "std_msgs/String")),
            Pair(
                Link("/b", Direction.TO_ROS2, "std_msgs/Int16", "std_msgs/String"),
                "no rule makes [std_msgs/Int16] a [std_msgs/String]: write one for --rules",
            ),
        ]
        assert not side.publishers
        await bridge.look()
        assert list(side.publishers) == ["/a"]
        assert [link.topic for link in bridge.topics.refused] == ["/b"]

    bridged(scene, NameFilter.of(["/a", "/b"]))


@pytest.mark.usefixtures("master")
def test_link_that_cannot_be_opened_leaves_nothing_open() -> None:
    async def scene(node: Node, side: FakeSide, bridge: Ros2Bridge) -> None:
        # Keep a reference, because a subscription without one leaves the graph.
        subscription = await node.subscribe_raw("/t", lambda *_: None)
        side.graph["/t"] = Ros2Topic(publishers=(STRING,))

        def subscribe(*_: object, **__: object) -> FakeSubscription:
            raise ValueError("no room")

        side.subscribe = subscribe  # type: ignore[method-assign]
        await bridge.look()
        assert list(bridge.topics.refused.values()) == ["no room"]
        assert "/t" not in (await fetch(node.call_master)).publishers
        assert subscription.topic == "/t"

    bridged(scene)


@pytest.mark.usefixtures("master")
def test_a_type_that_only_its_publisher_knows_is_bridged() -> None:
    async def scene(node: Node, side: FakeSide, bridge: Ros2Bridge) -> None:
        type_ = InterfaceType("std_msgs/Int8", "27ffa0c9c4b8fb8492252bcad9e5c57b", "int8 data\n")
        publisher = await node.advertise("/t", raw_class(type_))
        bridge._types._catalogue = type(catalogue())({})
        side.graph["/t"] = Ros2Topic(subscribers=(Ros2End("/peer", "std_msgs/Int8"),))
        await bridge.look()
        await connected(bridge)
        publisher.publish_raw(struct.pack("b", -3))
        await side.publishers["/t"].arrived.wait()
        assert side.publishers["/t"].sent[0][4:] == b"\xfd"

    bridged(scene)


def test_static_transforms_are_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("minirospy.core.tf2.statics.MAX_FRAMES", 3)
    statics = StaticTransforms()
    assert statics.merged(transforms("a", "b")) == transforms("a", "b")
    assert statics.merged(transforms("c", "d", "a")) == transforms("a", "b", "c")
    assert statics.left_out == 1
    assert statics.merged(transforms("b")) == transforms("a", "b", "c")
    assert statics.left_out == 1

    monkeypatch.setattr("minirospy.core.tf2.statics.MAX_BYTES", 1000)
    statics = StaticTransforms()
    long = "x" * 800
    assert statics.merged(transforms(long)) == transforms(long)
    assert statics.merged(transforms("a" * 200)) == transforms(long)
    assert statics.merged(transforms("a")) == transforms(long, "a")
    assert statics.left_out == 1


@pytest.mark.usefixtures("master")
def test_static_transforms_over_the_limit_are_reported(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("minirospy.core.tf2.statics.MAX_FRAMES", 1)

    async def scene(node: Node, side: FakeSide, bridge: Ros2Bridge) -> None:
        link = Link("/tf_static", Direction.TO_ROS2, "tf2_msgs/TFMessage", "tf2_msgs/TFMessage", True)
        passing = TopicPassing(bridge, link, cast("Any", None))
        for _ in range(3):
            assert passing._with_statics(transforms("a", "b")) == transforms("a")

    bridged(scene)
    lines = [each.getMessage() for each in caplog.records]
    assert len([each for each in lines if "new frames are not passed on" in each]) == 1


@pytest.mark.usefixtures("master")
def test_types_that_peers_make_up_are_forgotten(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("minirospy.introspect.type_texts.MAX_NAMES", 10)

    async def scene(node: Node, side: FakeSide, bridge: Ros2Bridge) -> None:
        texts = bridge._texts
        for number in range(25):
            assert await texts.installed(f"made_up_msgs/Type{number}") is None
            assert len(texts._installed) <= 10
        assert await texts.installed("std_msgs/Int8")
        assert "std_msgs/Int8" in texts._installed

    bridged(scene)


# --- the command


def test_fast_dds_gets_room_for_images_unless_it_is_set_up_already() -> None:
    file = large_message_settings({})["FASTDDS_DEFAULT_PROFILES_FILE"]
    assert "<segment_size>33554432</segment_size>" in Path(file).read_text(encoding="utf-8")
    assert large_message_settings({"RMW_IMPLEMENTATION": "rmw_fastrtps_cpp"})
    assert "FASTRTPS_DEFAULT_PROFILES_FILE" in large_message_settings({"ROS_DISTRO": "humble"})
    for name, value in (
        ("RMW_IMPLEMENTATION", "rmw_cyclonedds_cpp"),
        ("FASTDDS_DEFAULT_PROFILES_FILE", "mine.xml"),
        ("FASTRTPS_DEFAULT_PROFILES_FILE", "mine.xml"),
        ("FASTDDS_BUILTIN_TRANSPORTS", "UDPv4"),
    ):
        assert large_message_settings({name: value}) == {}


def test_without_rclpy_one_line_says_what_to_do(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    # Test without rclpy, even if ROS 2 is installed.
    monkeypatch.setitem(sys.modules, "rclpy", None)
    assert main([]) == 1
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert said.startswith("minirospy ros2-bridge: ERROR: ROS 2 cannot be imported (")
    assert "source its setup file first" in said


def test_a_rules_file_that_is_wrong_ends_the_command(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rules = tmp_path / "rules.yaml"
    rules.write_text("- x")
    assert main(["--rules", str(rules)]) == 1
    assert capsys.readouterr().err == (
        f"minirospy ros2-bridge: ERROR: {rules}: rule 1: is not a mapping such as 'ros1_package_name: my_msgs'\n"
    )
    assert main(["--rules", str(tmp_path / "none.yaml")]) == 1
    assert "none.yaml: No such file or directory" in capsys.readouterr().err
