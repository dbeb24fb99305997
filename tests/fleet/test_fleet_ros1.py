"""Gateways with zenoh-bridge-ros1's keys, with real Zenoh sessions, masters and nodes, and a peer that uses no minirospy code."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import pytest
from std_msgs.msg import String
from std_srvs.srv import Empty, SetBool, SetBoolResponse

from minirospy.base.errors import BridgeError, ServiceException
from minirospy.base.name_filter import NameFilter
from minirospy.fleet import ros1_keys
from minirospy.fleet.ros1_side import Ros1Side
from minirospy.fleet.ros1_topic import MARK
from minirospy.fleet.rules import GatewayRules
from tests.fleet.fleet import SECONDS, Fleet, Place
from tests.fleet.test_fleet_gateways import collect, publisher

pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")
from tests.fleet.ros1_peer import Ros1Peer

STRING = "std_msgs/String", "992ce8a1687cec8c8bd883ec73ca41d1"
SWITCH = "std_srvs/SetBool", "09fb03525b03e7ea1fd3992bafd87e16"
EMPTY = "std_srvs/Empty", "d41d8cd98f00b204e9800998ecf8427e"


@pytest.fixture(autouse=True)
def _patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """Raise the time limits, so that nothing is lost if the machine stalls and no log line is repeated."""
    monkeypatch.setattr(ros1_keys, "LOST_SECONDS", SECONDS)
    monkeypatch.setattr("minirospy.runtime.transport.rate_limited_logger.INTERVAL_SECONDS", 1000.0)


@pytest.fixture
def fleet() -> Iterator[Fleet]:
    """Yield masters, gateways and nodes on one loop."""
    running = Fleet()
    yield running
    running.close()


@pytest.fixture
def peer(fleet: Fleet) -> Iterator[Callable[..., Ros1Peer]]:
    """Return a function that connects a robot with zenoh-bridge-ros1."""
    made: list[Ros1Peer] = []

    def connect(**options: Any) -> Ros1Peer:
        made.append(Ros1Peer(fleet.endpoint, **options))
        return made[-1]

    yield connect
    for each in made:
        each.close()


def gateway(place: Place, namespace: str = "*", **options: Any) -> Ros1Side:
    """Start a gateway with these keys; return its ROS 1 side."""
    found = place.gateway(ros1_namespace=namespace, **options).ros1
    assert found is not None
    return found


def text(data: str) -> bytes:
    """Return a serialized std_msgs/String, written by hand."""
    return len(data).to_bytes(4, "little") + data.encode()


def serve(fleet: Fleet, place: Place, name: str, node: str = "server") -> list[bool]:
    """Offer a switch that refuses to be turned off; return the list of its requests."""
    asked: list[bool] = []

    async def switch(request: Any) -> SetBoolResponse:
        asked.append(request.data)
        if not request.data:
            raise ServiceException("the lamp is stuck")
        return SetBoolResponse(True, "on")

    made = place.node(node)

    async def start() -> None:
        await made.serve(name, SetBool, switch)

    fleet.run(start())
    return asked


def until_serves(fleet: Fleet, place: Place, *names: str) -> None:
    async def are_there() -> bool:
        return set(names) <= await place.fetch_services()

    fleet.until(are_there)


def test_topic_of_here_reaches_the_bridge(fleet: Fleet, peer: Callable[..., Ros1Peer]) -> None:
    place = fleet.place()
    chat = publisher(fleet, place, "/arm/chat", String)
    running = gateway(place, listens=True)
    robot = peer()
    fleet.until(lambda: robot.has_received("pub", *STRING, "/arm/chat"))
    # There is no subscriber, so the gateway does not subscribe.
    assert running.topics["/arm/chat"].outbound is None

    found = robot.subscribe(*STRING, "/arm/chat")
    robot.announce("sub", *STRING, "/arm/chat")
    fleet.run(chat.wait_for_subscribers(1, SECONDS))
    for number in range(100):
        fleet.run(chat.publish(f"hello {number}"))
    fleet.until(lambda: len(found) >= 100)
    assert found == [text(f"hello {number}") for number in range(100)]


def test_topic_of_the_bridge_is_shown_here_and_passed(fleet: Fleet, peer: Callable[..., Ros1Peer]) -> None:
    place = fleet.place()
    gateway(place, listens=True)
    robot = peer(mode="peer")
    robot.announce("pub", *STRING, "/arm/chat")
    fleet.until_shown(place, "/arm/chat")
    found = collect(fleet, place, "/arm/chat", String)
    fleet.until(lambda: robot.has_received("sub", *STRING, "/arm/chat"))
    # An announced topic can be used: the first message arrives.
    sender = robot.publisher(*STRING, "/arm/chat")
    for number in range(100):
        sender.put(text(f"hello {number}"))
    fleet.until(lambda: len(found) >= 100)
    assert [each.data for each in found] == [f"hello {number}" for number in range(100)]
    assert found[0]._connection_header["message_definition"]


def test_messages_without_any_beacon_are_passed_both_ways(
    fleet: Fleet, peer: Callable[..., Ros1Peer]
) -> None:
    """A bridge sends no beacon while another one sends the same. A program that only uses Zenoh sends none."""
    place = fleet.place()
    chat = publisher(fleet, place, "/out", String)
    received = collect(fleet, place, "/in", String)
    gateway(place, listens=True)
    robot = peer()
    found = robot.subscribe(*STRING, "/out")
    fleet.run(chat.wait_for_subscribers(1, SECONDS))
    fleet.run(chat.publish("to zenoh"))
    fleet.until(lambda: found == [text("to zenoh")])
    fleet.until(lambda: robot.has_received("sub", *STRING, "/in"))
    robot.publisher(*STRING, "/in").put(text("from zenoh"))
    fleet.until(lambda: [each.data for each in received] == ["from zenoh"])


def test_subscriber_of_the_bridge_is_shown_here(fleet: Fleet, peer: Callable[..., Ros1Peer]) -> None:
    place = fleet.place()
    gateway(place, listens=True)
    robot = peer()
    robot.announce("sub", *STRING, "/orders")
    found = robot.subscribe(*STRING, "/orders")
    fleet.until_shown(place, "/orders")
    orders = publisher(fleet, place, "/orders", String)
    fleet.run(orders.wait_for_subscribers(1, SECONDS))
    fleet.run(orders.publish("go"))
    fleet.until(lambda: found == [text("go")])


def test_services_are_called_both_ways(fleet: Fleet, peer: Callable[..., Ros1Peer]) -> None:
    place = fleet.place()
    asked = serve(fleet, place, "/lamp")
    gateway(place, listens=True)
    robot = peer()
    fleet.until(lambda: robot.has_received("srv", *SWITCH, "/lamp"))
    assert robot.call(*SWITCH, "/lamp", b"\1") == b"\1\2\0\0\0on"
    with pytest.raises(RuntimeError, match="the lamp is stuck"):
        robot.call(*SWITCH, "/lamp", b"\0")
    assert asked == [True, False]

    def door(request: bytes) -> bytes:
        if request != b"\1":
            raise RuntimeError("the door is locked")
        return b"\1\4\0\0\0open"

    robot.serve(*SWITCH, "/door", door)
    robot.announce("srv", *SWITCH, "/door")
    client = place.node("client")
    fleet.run(client.wait_for_service("/door", SECONDS))
    assert fleet.run(client.call("/door", SetBool, True)).message == "open"
    # The bridge sends an error in the same way as a response.
    with pytest.raises(ServiceException, match="the door is locked"):
        fleet.run(client.call("/door", SetBool, False))

    pressed: list[bytes] = []

    def bell(request: bytes) -> bytes:
        pressed.append(request)
        return b""

    robot.serve(*EMPTY, "/bell", bell)
    robot.announce("srv", *EMPTY, "/bell")
    fleet.run(client.wait_for_service("/bell", SECONDS))
    fleet.run(client.call("/bell", Empty))
    assert pressed == [b""]


def test_a_gateway_connects_to_a_bridge_that_listens(fleet: Fleet, peer: Callable[..., Ros1Peer]) -> None:
    robot = peer(mode="peer", listens=True)
    place = fleet.place()
    asked = serve(fleet, place, "/lamp")
    chat = publisher(fleet, place, "/chat", String)
    gateway(place)
    fleet.until(
        lambda: robot.has_received("pub", *STRING, "/chat") and robot.has_received("srv", *SWITCH, "/lamp")
    )
    found = robot.subscribe(*STRING, "/chat")
    fleet.run(chat.wait_for_subscribers(1, SECONDS))
    fleet.run(chat.publish("hello"))
    fleet.until(lambda: found == [text("hello")])
    assert robot.call(*SWITCH, "/lamp", b"\1") == b"\1\2\0\0\0on"
    assert asked == [True]

    robot.announce("pub", *STRING, "/answers")
    robot.serve(*SWITCH, "/door", lambda _: b"\1\4\0\0\0open")
    robot.announce("srv", *SWITCH, "/door")
    heard = collect(fleet, place, "/answers", String)
    fleet.until(lambda: robot.has_received("sub", *STRING, "/answers"))
    robot.publisher(*STRING, "/answers").put(text("hello, too"))
    fleet.until(lambda: [each.data for each in heard] == ["hello, too"])
    client = place.node("client")
    fleet.run(client.wait_for_service("/door", SECONDS))
    assert fleet.run(client.call("/door", SetBool, True)).message == "open"


def test_a_service_of_this_master_is_not_replaced(fleet: Fleet, peer: Callable[..., Ros1Peer]) -> None:
    place = fleet.place()
    asked = serve(fleet, place, "/lamp")
    running = gateway(place, listens=True)
    robot = peer()
    robot.serve(*SWITCH, "/lamp", lambda _: b"\1\5\0\0\0there")
    robot.serve(*SWITCH, "/door", lambda _: b"\1\5\0\0\0there")
    for name in ("/lamp", "/door"):
        robot.announce("srv", *SWITCH, name)
    until_serves(fleet, place, "/door")
    client = place.node("client")
    assert fleet.run(client.call("/lamp", SetBool, True)).message == "on"
    assert fleet.run(client.call("/door", SetBool, True)).message == "there"
    # A service that starts here later takes precedence.
    later = serve(fleet, place, "/door", "later")
    fleet.until(lambda: "/door" not in running.services)
    assert fleet.run(client.call("/door", SetBool, True)).message == "on"
    assert (asked, later) == ([True], [True])


def until_lost(fleet: Fleet, running: Ros1Side, *names: str) -> None:
    """Wait until a gateway misses resources; let their last beacons be too old, so that no second passes."""

    def are_lost() -> bool:
        found = [resource for resource in list(running.sightings) if resource.name in names]
        for resource in found:
            running.sightings.received(resource, float("-inf"))
        return not found

    fleet.until(are_lost)


def test_topics_removed_there_leave_this_master_and_return(
    fleet: Fleet, peer: Callable[..., Ros1Peer]
) -> None:
    place = fleet.place()
    running = gateway(place, listens=True)
    robot = peer()
    robot.announce("pub", *STRING, "/chat")
    robot.announce("sub", *STRING, "/orders")
    robot.serve(*SWITCH, "/door", lambda _: b"\1\0\0\0\0")
    robot.announce("srv", *SWITCH, "/door")
    fleet.until_shown(place, "/chat", "/orders")
    until_serves(fleet, place, "/door")
    assert {each.name for each in running.sightings} == {"/chat", "/orders", "/door"}
    robot.withdraw("sub", *STRING, "/orders")
    until_lost(fleet, running, "/orders")
    fleet.until_gone(place, "/orders")
    assert "/chat" in place.names()
    # Simulate a killed process, which others notice only by its silence.
    robot.close()
    until_lost(fleet, running, "/chat", "/door")
    fleet.until_gone(place, "/chat")

    async def is_gone() -> bool:
        return "/door" not in await place.fetch_services()

    fleet.until(is_gone)
    again = peer()
    again.announce("pub", *STRING, "/chat")
    fleet.until_shown(place, "/chat")
    found = collect(fleet, place, "/chat", String)
    fleet.until(lambda: again.has_received("sub", *STRING, "/chat"))
    again.publisher(*STRING, "/chat").put(text("back"))
    fleet.until(lambda: [each.data for each in found] == ["back"])


def test_removed_topics_are_not_announced_any_more(fleet: Fleet, peer: Callable[..., Ros1Peer]) -> None:
    place = fleet.place()
    chat = publisher(fleet, place, "/chat", String)
    other = publisher(fleet, place, "/other", String, name="other")
    running = gateway(place, listens=True)
    robot = peer()
    fleet.until(
        lambda: robot.has_received("pub", *STRING, "/chat") and robot.has_received("pub", *STRING, "/other")
    )
    fleet.run(chat.close())
    fleet.until(lambda: running.status()["announced"] == 1)
    # A beacon that was in transit would arrive before that of a later topic.
    publisher(fleet, place, "/later", String, name="later")
    fleet.until(lambda: robot.has_received("pub", *STRING, "/later"))
    robot.received.clear()
    fleet.until(lambda: sum(robot.received.values()) >= 3)
    assert not robot.has_received("pub", *STRING, "/chat")
    fleet.run(other.close())


def test_latched_message_reaches_a_bridge_that_comes_later(
    fleet: Fleet, peer: Callable[..., Ros1Peer]
) -> None:
    place = fleet.place()
    maps = publisher(fleet, place, "/map", String, latch=True)
    fleet.run(maps.publish("walls"))
    running = gateway(place, listens=True)
    fleet.until(lambda: "/map" in running.topics)
    link = running.topics["/map"]
    for _ in range(2):
        robot = peer()
        found = robot.subscribe(*STRING, "/map")
        robot.announce("sub", *STRING, "/map")
        fleet.until(partial(bool, found))
        assert set(found) == {text("walls")}
        robot.close()
        fleet.until(lambda: not link._is_matched)


def test_gateways_of_two_masters_pass_these_keys_without_loops(
    fleet: Fleet, peer: Callable[..., Ros1Peer]
) -> None:
    one, two = fleet.place(), fleet.place()
    gateway(one, listens=True)
    gateway(two)
    robot = peer()
    seen = robot.subscribe(*STRING, "/chat")
    places = {"one": one, "two": two}
    said = {name: publisher(fleet, place, "/chat", String) for name, place in places.items()}
    found = {name: collect(fleet, place, "/chat", String) for name, place in places.items()}

    def received(of: str) -> list[list[str]]:
        """Return the messages that each place has received in a round."""
        texts = [*([each.data for each in messages] for messages in found.values())]
        every = [*texts, [each[4:].decode() for each in seen]]
        return [[each for each in messages if each.startswith(of)] for messages in every]

    def all_received(turn: str) -> bool:
        return all(len(messages) >= 2 for messages in received(turn))

    async def reaches_all() -> bool:
        for name, each in said.items():
            await each.publish(f"try of {name}")
        return all(set(messages) == {"try of one", "try of two"} for messages in received("try"))

    # Repeat until every place receives the messages of all places.
    fleet.until(reaches_all)
    for turn in ("first", "second"):
        for name, each in said.items():
            fleet.run(each.publish(f"{turn} of {name}"))
        fleet.until(partial(all_received, turn))
    # A message that returned would have arrived before the second round.
    assert [sorted(messages) for messages in received("first")] == [["first of one", "first of two"]] * 3


def test_a_second_gateway_of_these_keys_is_refused(fleet: Fleet) -> None:
    place = fleet.place()
    gateway(place, listens=True)
    with pytest.raises(
        BridgeError, match=r"^/fleet_control passes the keys of zenoh-bridge-ros1 on this mast"
    ):
        gateway(place, name="robot1")


def test_topics_of_another_gateway_of_this_master_are_not_announced(
    fleet: Fleet, peer: Callable[..., Ros1Peer], caplog: pytest.LogCaptureFixture
) -> None:
    """This happens if two gateways start at the same moment, or if zenoh-bridge-ros1 itself starts later."""
    place = fleet.place()
    gateway(place, listens=True)
    chat = publisher(fleet, place, "/chat", String, name="ros1_to_zenoh_bridge", headers={MARK: "1"})
    collect(fleet, place, "/orders", String, name="ros1_to_zenoh_bridge_service_cache_node")
    serve(fleet, place, "/lamp", node="ros1_to_zenoh_bridge2")
    publisher(fleet, place, "/other", String)
    robot = peer()
    fleet.until(lambda: robot.has_received("pub", *STRING, "/other"))
    assert [key.partition("/")[0] for key in robot.received] == ["pub"]

    # Messages are not forwarded before the graph has been read, either.
    found = robot.subscribe(*STRING, "/chat")
    robot.announce("sub", *STRING, "/chat")
    mine = publisher(fleet, place, "/chat", String, name="mine")
    for each in (chat, mine):
        fleet.run(each.wait_for_subscribers(1, SECONDS))
    fleet.run(chat.publish("of the bridge"))
    fleet.run(mine.publish("mine"))
    fleet.until(lambda: found)
    fleet.run(mine.publish("mine"))
    fleet.until(lambda: len(found) >= 2)
    assert found == [text("mine")] * 2
    lines = [record.getMessage() for record in caplog.records if "messages come twice" in record.getMessage()]
    assert len(lines) == 3


def test_hostile_beacons_are_refused_in_one_line(
    fleet: Fleet, peer: Callable[..., Ros1Peer], caplog: pytest.LogCaptureFixture
) -> None:
    place = fleet.place()
    before = place.names()
    running = gateway(place, listens=True)
    robot = peer()
    string = b"std_msgs/String".hex()
    for key in (
        f"pub/zz/{STRING[1]}/*/chat",
        f"pub/{b'x'.hex()}/{STRING[1]}/*/chat",
        f"pub/{string}/{'0' * 31}/*/chat",
        f"pub/{string}/{STRING[1]}/*/{'a/' * 2000}b",
        f"srv/{string}/{STRING[1]}/*/\x1b[31mred",
        f"nod/{string}/{STRING[1]}/*/chat",
    ):
        robot.announce_key(f"ros1_discovery_info/*/{key}")
    fleet.until(lambda: running.refused >= 6)
    robot.announce("pub", *STRING, "/good")
    fleet.until_shown(place, "/good")
    assert place.names() - before == {"/good", "/minirospy/ros1_keys"}
    lines = [record.getMessage() for record in caplog.records if "left out" in record.getMessage()]
    assert len(lines) == 1
    assert lines[0].isprintable()
    assert len(lines[0]) < 300


def test_a_topic_of_another_type_is_left_out_in_one_line(
    fleet: Fleet, peer: Callable[..., Ros1Peer], caplog: pytest.LogCaptureFixture
) -> None:
    place = fleet.place()
    chat = publisher(fleet, place, "/chat", String)
    gateway(place, listens=True)
    robot = peer()
    robot.announce("sub", "std_msgs/Int32", "da5909fbe378aeaf85e547e830cc1bb7", "/chat")
    robot.announce("sub", *STRING, "/later")
    fleet.until_shown(place, "/later")
    found = robot.subscribe(*STRING, "/chat")
    fleet.run(chat.wait_for_subscribers(1, SECONDS))
    fleet.run(chat.publish("still here"))
    fleet.until(lambda: found == [text("still here")])
    lines = [record.getMessage() for record in caplog.records if "is of type" in record.getMessage()]
    assert len(lines) == 1
    assert lines[0].startswith("/chat of others is not passed: it is of type std_msgs/Int32 ")


def test_namespaces_and_names_keep_robots_apart(fleet: Fleet, peer: Callable[..., Ros1Peer]) -> None:
    place = fleet.place()
    rules = GatewayRules(topics=NameFilter.of(["/a*"]), services=NameFilter.of(["/a*"]))
    gateway(place, "robot1", listens=True, rules=rules)
    publisher(fleet, place, "/b_here", String)
    publisher(fleet, place, "/a_here", String, name="another")
    near, far, every = peer(namespace="robot1"), peer(namespace="robot2"), peer()
    for each, name in ((far, "/a_far"), (near, "/b_near"), (near, "/a_near"), (every, "/a_every")):
        each.announce("pub", *STRING, name)
    fleet.until_shown(place, "/a_near", "/a_every")
    fleet.until(lambda: near.has_received("pub", *STRING, "/a_here"))
    assert not place.names() & {"/a_far", "/b_near"}
    assert not near.has_received("pub", *STRING, "/b_here")
    assert not far.has_received("pub", *STRING, "/a_here")


def test_the_status_names_what_is_passed(fleet: Fleet, peer: Callable[..., Ros1Peer]) -> None:
    place = fleet.place()
    found = collect(fleet, place, "/chat", String)
    running = gateway(place, listens=True)
    robot = peer()
    robot.announce("pub", *STRING, "/chat")
    fleet.until(lambda: robot.has_received("sub", *STRING, "/chat"))
    robot.publisher(*STRING, "/chat").put(text("hello"))
    fleet.until(lambda: found)
    # The robot's next beacon may arrive after its message.
    fleet.until(lambda: running.status()["seen"])
    status: Any = running.status()
    assert status["namespace"] == "*"
    assert (status["announced"], status["seen"], status["refused"]) == (1, 1, 0)
    assert status["passed_in"] == [{"topic": "/chat", "messages": 1}]
