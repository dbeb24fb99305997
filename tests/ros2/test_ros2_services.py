"""Services in the ROS 2 bridge with a fake backend in place of rclpy: offers, responses, rejections and removal."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable, Mapping
from typing import Any

import pytest

from minirospy import Node
from minirospy.aio import raw
from minirospy.aio.raw import RawService, call_raw, service_header
from minirospy.base.errors import BridgeError, ServiceException
from minirospy.base.name_filter import NameFilter
from minirospy.cli.ros2_bridge import main
from minirospy.core.idl.load import service_class
from minirospy.core.wire.header import Header, serialize_header
from minirospy.core.wire.service import serialize_response
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.ros2.bridge import Ros2Bridge, Ros2Options
from minirospy.ros2.links import BRIDGE_PREFIX, Direction
from minirospy.ros2.rules import BUILT_IN
from minirospy.ros2.service_links import ServiceLink, service_links
from tests.ros2.ros2_definitions import catalogue
from tests.ros2.test_ros2_bridge import FakeSide
from tests.waiting import until

SET_BOOL = "std_srvs/SetBool"
LIMIT = 60.0


def of(
    ros1: Mapping[str, tuple[str, ...]], ros2: Mapping[str, str], types: Mapping[str, str] | None = None
) -> list[tuple[str, Direction]]:
    known = dict.fromkeys(ros1, SET_BOOL) if types is None else types
    found = service_links(ros1, known, ros2, lambda type_, _: type_)
    return [(link.service, link.direction) for link in found]


def test_a_service_of_one_side_alone_is_linked() -> None:
    assert of({"/a": ("/n",)}, {}) == [("/a", Direction.TO_ROS1)]
    assert of({}, {"/b": SET_BOOL}) == [("/b", Direction.TO_ROS2)]
    assert of({"/a": ("/n",)}, {"/a": SET_BOOL}) == []


def test_services_of_bridges_do_not_count() -> None:
    assert of({"/a": ("/minirospy_ros2_bridge",)}, {"/a": SET_BOOL}) == [("/a", Direction.TO_ROS2)]
    assert of({"/a": ("/lab/minirospy_ros2_bridge_list",)}, {}) == []


def test_services_that_every_node_has_are_not_offered_to_the_other_side() -> None:
    types = {"/n/get_loggers": "roscpp/GetLoggers"}
    hidden = {
        "/fly/_action/send_goal": "my/Fly_SendGoal",
        "/m/get_parameters": "rcl_interfaces/GetParameters",
    }
    assert of({"/n/get_loggers": ("/n",), "/unknown": ("/n",)}, hidden, types) == []


def test_renamed_service_types_find_their_partner() -> None:
    assert BUILT_IN.ros2_services("rospy_tutorials/AddTwoInts") == ("example_interfaces/AddTwoInts",)
    assert BUILT_IN.ros1_services("example_interfaces/AddTwoInts")[0] == "example_interfaces/AddTwoInts"


# --- the bridge


@pytest.fixture(autouse=True)
def _patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """Raise the limits, so that no request is sent before the server can be reached."""
    monkeypatch.setattr("minirospy.ros2.reach.MAX_SECONDS", LIMIT)


def bridged(
    scene: Callable[[Node, FakeSide, Ros2Bridge], Any],
    services: NameFilter | None = None,
    call_seconds: float = LIMIT,
) -> FakeSide:
    side = FakeSide()
    options = Ros2Options(services=services or NameFilter(), call_seconds=call_seconds)

    async def run() -> None:
        async with Node("other", rosout=False) as node, Node(BRIDGE_PREFIX, rosout=False) as own:
            bridge = Ros2Bridge(own, side, options, catalogue())
            try:
                await asyncio.wait_for(scene(node, side, bridge), LIMIT)
            finally:
                await bridge.close()

    asyncio.run(run())
    assert side.is_closed
    return side


def interface(name: str) -> InterfaceType:
    return InterfaceType.of(service_class(name))


async def call(node: Node, service: str, request: bytes, type_: str = SET_BOOL) -> bytes:
    return await call_raw(node, service, interface(type_)[1], request)


@pytest.mark.usefixtures("master")
def test_a_server_of_ros2_is_called_from_ros1_until_it_ends() -> None:
    async def scene(node: Node, side: FakeSide, bridge: Ros2Bridge) -> None:
        side.offered["/set"] = SET_BOOL
        assert await bridge.look()
        assert not await bridge.look()
        assert (await service_header(node, "/set"))["type"] == SET_BOOL
        side.clients["/set"].response = b"\0\1\0\0\1\0\0\0\3\0\0\0ok\0"
        assert await call(node, "/set", b"\1") == b"\1\2\0\0\0ok"
        assert side.clients["/set"].requests == [b"\0\1\0\0\1"]

        side.offered.clear()
        assert await bridge.look()
        assert side.clients["/set"].is_closed
        with pytest.raises(ServiceException, match="unavailable"):
            await call(node, "/set", b"\1")

    bridged(scene)


@pytest.mark.usefixtures("master")
def test_a_client_of_ros1_gets_the_reason_of_a_failure() -> None:
    async def scene(node: Node, side: FakeSide, bridge: Ros2Bridge) -> None:
        side.offered["/set"] = SET_BOOL
        await bridge.look()
        with pytest.raises(ServiceException, match=r"has not answered within 0.2 s"):
            await call(node, "/set", b"\1")
        side.clients["/set"].response = b"\0\1\0\0"
        with pytest.raises(ServiceException, match=r"cannot convert a message .*ends too early"):
            await call(node, "/set", b"\1")
        with pytest.raises(ServiceException, match=r"cannot convert a message .*bytes follow"):
            await call(node, "/set", b"\1\2")
        with pytest.raises(ServiceException, match="md5sums do not match"):
            await call(node, "/set", b"\1", "std_srvs/Empty")
        side.clients["/set"].is_ready = False
        with pytest.raises(ServiceException, match="has no server in ROS 2 any more"):
            await call(node, "/set", b"\1")

    bridged(scene, call_seconds=0.2)


@pytest.mark.usefixtures("master")
def test_the_first_call_waits_until_responses_of_the_server_arrive() -> None:
    async def scene(node: Node, side: FakeSide, bridge: Ros2Bridge) -> None:
        side.offered["/set"] = SET_BOOL
        side.has_found_client = False
        await bridge.look()
        client = side.clients["/set"]
        client.response = b"\0\1\0\0\1\0\0\0\3\0\0\0ok\0"
        assert client.prober
        await until(lambda: client.prober and client.prober.reaching)
        calling = asyncio.ensure_future(call(node, "/set", b"\1"))
        await until(lambda: len(client.prober.reaching) > 1 if client.prober else False)
        assert not client.requests
        client.prober.answers = True
        client.prober.reaching[-1].set_result(None)
        assert await calling == b"\1\2\0\0\0ok"

        # Pending calls fail when the server is lost.
        client.servers = frozenset({b"2"})
        client.prober.answers = False
        calling = asyncio.ensure_future(call(node, "/set", b"\1"))
        sent = len(client.prober.reaching)
        await until(lambda: client.prober and len(client.prober.reaching) > sent)
        side.offered.clear()
        assert await bridge.look()
        with pytest.raises(ServiceException, match="has no server in ROS 2 any more"):
            await calling
        assert len(client.requests) == 1

    bridged(scene)


@pytest.mark.usefixtures("master")
def test_a_call_ends_with_the_server_of_ros2() -> None:
    async def scene(node: Node, side: FakeSide, bridge: Ros2Bridge) -> None:
        side.offered["/set"] = SET_BOOL
        await bridge.look()
        calling = asyncio.ensure_future(call(node, "/set", b"\1"))
        await until(lambda: side.clients["/set"].requests)
        side.clients["/set"].is_ready = False
        with pytest.raises(ServiceException, match="has ended during the call"):
            await calling

    bridged(scene)


@pytest.mark.usefixtures("master")
def test_a_server_of_ros1_is_called_from_ros2_until_it_ends() -> None:
    async def answer(request: bytes, _: Header) -> bytes:
        if request == b"\0":
            raise ServiceException("no")
        return b"\1\2\0\0\0ok"

    async def scene(node: Node, side: FakeSide, bridge: Ros2Bridge) -> None:
        server = await RawService(node, "/set", interface(SET_BOOL), answer)
        await bridge.look()
        there = side.servers["/set"]
        answered = await asyncio.wrap_future(there.answer(b"\0\1\0\0\1\0\0\0"))
        assert answered[4:] == b"\1\0\0\0\3\0\0\0ok\0"
        with pytest.raises(BridgeError, match=r"responded with an error.*no"):
            await asyncio.wrap_future(there.answer(b"\0\1\0\0\0\0\0\0"))
        await server.close()
        with pytest.raises(BridgeError, match="unavailable"):
            await asyncio.wrap_future(there.answer(b"\0\1\0\0\0\0\0\0"))
        assert await bridge.look()
        assert there.is_closed

    bridged(scene)


@pytest.mark.usefixtures("master")
def test_calls_that_come_as_their_link_is_closed_are_answered() -> None:
    async def scene(node: Node, side: FakeSide, bridge: Ros2Bridge) -> None:
        async def never(_: bytes, __: Header) -> bytes:
            await asyncio.Event().wait()
            return b""

        await RawService(node, "/set", interface(SET_BOOL), never)
        await bridge.look()
        there = side.servers["/set"]
        before = there.answer(b"\0\1\0\0\1\0\0\0")
        await asyncio.ensure_future(bridge.services.close())
        assert before.cancelled()
        with pytest.raises(BridgeError, match="not bridged any more"):
            await asyncio.wait_for(asyncio.wrap_future(there.answer(b"\0\1\0\0\1\0\0\0")), LIMIT)

    bridged(scene)


@pytest.mark.usefixtures("master")
def test_a_server_of_ros1_that_hangs_is_given_up() -> None:
    async def hang(_: bytes, __: Header) -> bytes:
        await asyncio.sleep(LIMIT)
        return b""

    async def scene(node: Node, side: FakeSide, bridge: Ros2Bridge) -> None:
        await RawService(node, "/set", interface(SET_BOOL), hang)
        await bridge.look()
        with pytest.raises(BridgeError, match=r"not answered within 0.2 s"):
            await asyncio.wrap_future(side.servers["/set"].answer(b"\0\1\0\0\0\0\0\0"))

    bridged(scene, call_seconds=0.2)


@pytest.mark.usefixtures("master")
def test_types_of_services_that_do_not_map_are_listed_with_the_reason() -> None:
    async def scene(node: Node, side: FakeSide, bridge: Ros2Bridge) -> None:
        async def never(_: bytes, __: Header) -> bytes:
            return b""

        add = interface("rospy_tutorials/AddTwoInts")
        await RawService(node, "/add", add, never)
        await RawService(node, "/other", InterfaceType(SET_BOOL, "0" * 32), never)
        await RawService(node, "/hidden", InterfaceType(SET_BOOL, "0" * 32), never)
        side.offered = {"/spawn": "turtlesim/Spawn", "/strange": "strange_msgs/Do"}
        pairs = [pair for pair in await bridge.pairs() if isinstance(pair.link, ServiceLink)]
        assert [(pair.link.service, bool(pair.reason)) for pair in pairs] == [
            ("/add", False), ("/other", True), ("/spawn", True), ("/strange", True),
        ]  # fmt: skip
        assert pairs[0].link == ServiceLink(
            "/add", Direction.TO_ROS1, "rospy_tutorials/AddTwoInts", "example_interfaces/AddTwoInts"
        )
        assert pairs[1].reason.startswith(f"its md5sum in ROS 1 is [{'0' * 32}], that of [{SET_BOOL}] here [")
        assert pairs[2].reason == "the service type [turtlesim/Spawn] is not installed in ROS 2"
        assert pairs[3].reason.startswith("the service type [strange_msgs/Do] is not defined here")
        assert not side.servers

    bridged(scene, NameFilter.of(["/add", "/other", "/s*"]))


def test_a_time_limit_of_calls_that_is_no_time_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--call-timeout", "0"]) == 1
    assert "--call-timeout 0 is not a number of seconds above 0" in capsys.readouterr().err


@pytest.mark.usefixtures("master")
def test_call_waits_longer_for_a_busy_server_than_a_probe(monkeypatch: pytest.MonkeyPatch) -> None:
    """Hundreds of concurrent calls are slow, and none of them may fail for that reason."""
    monkeypatch.setattr(raw, "PROBE_SECONDS", 0.05)
    answer = serialize_header({"callerid": "/n", "md5sum": "0" * 32, "type": "a/B"})

    serving: set[asyncio.StreamWriter] = set()

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        serving.add(writer)
        # A probe that gives up early sends no header.
        with contextlib.suppress(ConnectionError, asyncio.IncompleteReadError):
            await reader.readexactly(int.from_bytes(await reader.readexactly(4), "little"))
            await asyncio.sleep(0.5)
            writer.write(answer + serialize_response(b"done"))
        writer.close()
        with contextlib.suppress(ConnectionError):
            await writer.wait_closed()
        serving.discard(writer)

    async def run() -> None:
        server = await asyncio.start_server(serve, "127.0.0.1", 0)
        port = server.sockets[0].getsockname()[1]
        async with server, Node("caller", rosout=False) as node:
            uri = f"rosrpc://127.0.0.1:{port}"
            await node.call_master("registerService", "/late", uri, "http://127.0.0.1:1")
            with pytest.raises(ServiceException, match="cannot be reached"):
                await service_header(node, "/late")
            assert await call_raw(node, "/late", "*", b"") == b"done"
            await until(lambda: not serving)

    asyncio.run(run())
