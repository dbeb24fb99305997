"""A hostile peer in a fleet: wrong or missing replies, floods of names, a master that rejects calls. The robots keep working."""

from __future__ import annotations

import asyncio
import logging
from typing import Any

import pytest
from std_msgs.msg import String
from std_srvs.srv import SetBool, SetBoolResponse

from minirospy.base.errors import MasterUnreachableError
from minirospy.core.idl.load import class_from_text
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.fleet.definitions import MAX_QUERIES_OF_GATEWAY, Definitions
from minirospy.fleet.imported_topic import MAX_REGISTERING, ImportedTopic, Shared
from minirospy.fleet.importer import Importer
from minirospy.fleet.inquiry import fleet_status
from minirospy.fleet.keys import ROOT, Claim, TopicToken, call_key, claim_key, topic_key
from minirospy.fleet.network import FleetNetwork, QueryFailed
from minirospy.fleet.rules import GatewayRules
from tests.fleet.fleet import Fleet
from tests.fleet.test_fleet_gateways import collect, fleet, publisher
from tests.fleet.test_fleet_hostile import stub
from tests.fleet.test_fleet_names import control_room, lines, stranger
from tests.manual_loop import ManualLoop, run_manually
from tests.waiting import until

pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")

__all__ = ["fleet"]

LIAR = Claim("liar", "0" * 16, 1, "0" * 16)
TEXT = "int8 x\n"


async def silence(_: str, __: bytes) -> bytes:
    await asyncio.Event().wait()
    return b""


async def rubbish(_: str, __: bytes) -> bytes:
    return b"\xff\x00{" * 100_000


def serve_lamp(fleet: Fleet, robot: Any) -> None:
    node = robot.node("lamp")

    async def switch(_: object) -> SetBoolResponse:
        return SetBoolResponse(True, "on")

    async def serve() -> None:
        await node.serve("/lamp", SetBool, switch)

    fleet.run(serve())


@pytest.mark.parametrize("handler", [silence, rubbish])
def test_invalid_and_missing_answers_are_harmless(fleet: Fleet, handler: Any) -> None:
    robot, control = fleet.place(), fleet.place()
    thing = class_from_text("my_msgs/Thing", TEXT)
    things = publisher(fleet, robot, "/things", thing)
    importer = control_room(fleet, control)
    with stranger(fleet) as session:
        kept = [
            fleet.call(lambda kind=kind: session.answer(f"{ROOT}/{kind}/{LIAR.gateway}/**", handler))
            for kind in ("ping", "status", "definition")
        ]
        # Topics with the robot's type, so that the peer is queried for it first, and many more that the peer never describes.
        token = TopicToken("liar", LIAR.gateway, "/things", "my_msgs/Thing", thing._md5sum, True, False)
        names = [token, *(token._replace(topic=f"/t{n}", md5sum=f"{n:032x}") for n in range(300))]
        for key in [claim_key(LIAR), *map(topic_key, names)]:
            kept += [fleet.call(lambda key=key: session.declare_token(key))]
        fleet.until(lambda: "liar" in importer.robots)
        robot.gateway("robot1")
        fleet.until_shown(control, "/robot1/things")
        found = collect(fleet, control, "/robot1/things", thing)
        fleet.run(things.wait_for_subscribers(1, 60.0))
        fleet.run(things.publish(5))
        fleet.until(lambda: found)
        assert found[0]._connection_header["message_definition"] == TEXT

        robots, _ = fleet.run(fleet_status(session, 1.0))
        assert {each.claim.name: bool(each.status) for each in robots} == {"liar": False, "robot1": True}


def test_a_call_is_answered_though_another_answers_the_same_key_never(fleet: Fleet) -> None:
    robot, control = fleet.place(), fleet.place()
    serve_lamp(fleet, robot)
    importer = control_room(fleet, control)
    gateway = robot.gateway("robot1")
    client = control.node("client")
    fleet.run(client.wait_for_service("/robot1/lamp", 60.0))
    with stranger(fleet) as session:
        key = call_key("robot1", gateway.id, "/lamp", SetBool._md5sum)
        declared = fleet.call(lambda: session.answer(key, silence))
        # Its own answer would come too late: by then the control room knows the type.
        with pytest.raises(QueryFailed):
            fleet.run(session.query(f"{ROOT}/nobody", seconds=0.5))
        assert fleet.run(client.call("/robot1/lamp", SetBool, True)).message == "on"
        fleet.call(declared.undeclare)
    assert importer.robots


def test_a_query_that_ends_early_does_not_say_that_it_has_waited(fleet: Fleet) -> None:
    robot, control = fleet.place(), fleet.place()
    serve_lamp(fleet, robot)
    control_room(fleet, control)
    gateway = robot.gateway("robot1")
    # If a broken link cuts off a call, Zenoh ends the query without a reply, long before its timeout.
    match = "no answer: nobody answers there, or the link broke after"
    with stranger(fleet) as session, pytest.raises(QueryFailed, match=match):
        fleet.run(session.query(f"{ROOT}/call/robot1/{gateway.id}x/none", seconds=3600.0))


def test_only_as_many_replies_as_wanted_are_kept() -> None:
    def get(_: str, handler: Any, **__: object) -> None:
        for number in range(50):
            handler.callback(stub(ok=stub(key_expr=f"a/{number}", payload=Payload())))

    class Payload(bytes):
        def to_bytes(self) -> bytes:
            return b"x"

    async def check() -> None:
        network = FleetNetwork(stub(close=lambda: None, get=get), asyncio.get_running_loop())
        # The query never ends by itself.
        assert len(await network.queries("a/*", seconds=3600.0, most=10)) == 10
        assert await network.query("a/1", seconds=3600.0) == b"x"
        await network.close()

    asyncio.run(asyncio.wait_for(check(), 60.0))


def test_gateway_without_types_uses_only_its_own_slots() -> None:
    async def check() -> None:
        asked: list[str] = []

        async def query(key: str, **_: object) -> bytes:
            asked.append(key)
            if "0" * 16 in key:
                await asyncio.Event().wait()
            raise QueryFailed("unknown")

        definitions = Definitions(stub(), stub(query=query))
        definitions.texts = stub(installed=nothing, close=nothing)  # type: ignore[assignment]
        tasks = [
            asyncio.ensure_future(definitions.interface("x/Y", f"{number:032x}", "0" * 16))
            for number in range(1000)
        ]
        other = await definitions.interface("x/Y", "f" * 32, "1" * 16)
        assert other.definition == ""
        assert len(asked) == MAX_QUERIES_OF_GATEWAY + 1
        for task in tasks:
            task.cancel()
        await definitions.close()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def nothing(*_: object) -> None:
        return None

    asyncio.run(asyncio.wait_for(check(), 60.0))


def test_texts_of_types_are_kept_up_to_a_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("minirospy.fleet.definitions.MAX_CHARACTERS", 100)
    definitions = Definitions(stub(), stub())
    for number in range(20):
        definitions.learn("x/Y", f"{number:032x}", "x" * 10)
        definitions.learn("x/Y", f"{number:032x}", "x" * 10)
    assert len(definitions._known) == 10


def test_one_robot_takes_its_share_of_names_and_gives_its_memory_back(
    fleet: Fleet, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    trimmed: list[int] = []
    monkeypatch.setattr("minirospy.fleet.importer.MAX_ROBOT_NAMES", 20)
    monkeypatch.setattr("minirospy.fleet.importer.TRIM_NAMES", 20)
    monkeypatch.setattr("minirospy.fleet.importer.TRIM_SECONDS", 0.0)
    monkeypatch.setattr("minirospy.fleet.importer.return_free_memory", lambda: trimmed.append(1))
    control, robot = fleet.place(), fleet.place()
    importer = control_room(fleet, control)
    publisher(fleet, robot, "/chat", String)
    with stranger(fleet) as session:
        token = TopicToken("liar", LIAR.gateway, "/t", "std_msgs/String", String._md5sum, True, False)
        keys = [claim_key(LIAR), *(topic_key(token._replace(topic=f"/t{n}")) for n in range(100))]
        kept = [fleet.call(lambda key=key: session.declare_token(key)) for key in keys]
        fleet.until(lambda: "liar" in importer.robots and len(importer.robots["liar"].topics) == 20)
        robot.gateway("robot1")
        fleet.until_shown(control, "/robot1/chat")
        assert kept
        assert len(lines(caplog, "robot [liar] has more than 20 topics and services")) == 1
        assert not trimmed
    fleet.until(lambda: trimmed)
    assert list(importer.robots) == ["robot1"]


def test_a_master_that_registers_nothing_is_one_line(
    fleet: Fleet, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    robot, control = fleet.place(), fleet.place()
    importer = control_room(fleet, control)

    async def advertise(_: object) -> None:
        raise MasterUnreachableError(control.uri)

    monkeypatch.setattr(control.nodes[0]._node, "advertise", advertise)
    for number in range(30):
        publisher(fleet, robot, f"/t{number}", String, name=f"writer{number}")
    robot.gateway("robot1")
    fleet.until(lambda: "robot1" in importer.robots)
    robot1 = importer.robots["robot1"]
    fleet.until(lambda: len([each for each in robot1.topics.values() if each._publisher]) >= 30)
    found = [record for record in caplog.records if record.levelno == logging.CRITICAL]
    assert [record.getMessage().partition(" with ")[0] for record in found] in (
        [[f"unable to register publication [/robot1/t{number}]"] for number in range(30)]
    )


def test_tokens_that_are_oversized_or_malformed_are_left_out_in_one_line(
    fleet: Fleet, caplog: pytest.LogCaptureFixture
) -> None:
    robot, control = fleet.place(), fleet.place()
    importer = control_room(fleet, control)
    publisher(fleet, robot, "/chat", String)
    head = f"{ROOT}/topic/liar/{LIAR.gateway}"
    with stranger(fleet) as session:
        keys = [
            f"{head}/%{'x' * 50_000}/std_msgs%String/{String._md5sum}/p",
            f"{head}/%x/{'y' * 50_000}%String/{String._md5sum}/p",
            f"{head}/%x/std_msgs%String/{'0' * 50_000}/p",
            f"{head}/%x/std_msgs%String/{String._md5sum}/{'p' * 50_000}",
            f"{ROOT}/robot/{'r' * 50_000}/{LIAR.gateway}/1/{LIAR.host}",
            f"{ROOT}/robot/liar/{LIAR.gateway}/{'1' * 50_000}/{LIAR.host}",
            f"{ROOT}/robot/liar" + "/x" * 2_000,
            f"{ROOT}/robot",
        ]
        kept = [fleet.call(lambda key=key: session.declare_token(key)) for key in keys]
        robot.gateway("robot1")
        fleet.until_shown(control, "/robot1/chat")
        fleet.until(lambda: importer.contents.refused >= len(keys) - 1)
        assert kept
    assert list(importer.robots) == ["robot1"]
    assert len(lines(caplog, "what a gateway announces is not shown")) == 1


def test_topics_are_registered_so_many_at_a_time() -> None:
    async def check() -> None:
        loop = asyncio.get_running_loop()
        registrations: list[asyncio.Future[None]] = []

        def advertise(*_: object, **__: object) -> Any:
            registrations.append(loop.create_future())
            registration = registrations[-1]
            return stub(wait_until_registered=lambda: asyncio.wait([registration]), subscribers=())

        async def interface(*_: object) -> Any:
            return InterfaceType("std_msgs/String", String._md5sum)

        shared: Any = Shared(
            stub(name="/control", advertise=advertise),
            *[stub(interface=interface)] * 9,
        )
        token = TopicToken("robot1", "0" * 16, "/t", "std_msgs/String", String._md5sum, True, False)
        topics = [
            ImportedTopic(shared, token._replace(topic=f"/t{n}"), lambda: None)
            for n in range(3 * MAX_REGISTERING)
        ]
        tasks = [asyncio.ensure_future(topic._open()) for topic in topics]
        await until(lambda: len(registrations) >= MAX_REGISTERING)
        for _ in range(10):
            await asyncio.sleep(0)
        assert len(registrations) == MAX_REGISTERING
        registrations[0].set_result(None)
        await until(lambda: len(registrations) == MAX_REGISTERING + 1)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    asyncio.run(asyncio.wait_for(check(), 60.0))


def test_looks_pause_after_a_long_one_whatever_comes() -> None:
    spawned: list[Any] = []

    async def scene(loop: ManualLoop) -> None:
        made = Importer(
            stub(), stub(), stub(), stub(), stub(), "0" * 16, "", GatewayRules(), spawned.append, lambda: 0
        )
        made._not_before = loop.time() + 4.0
        made.changed(claim_key(LIAR), True)
        await loop.advance(3.9)
        made.changed(claim_key(LIAR._replace(name="other")), True)
        assert not spawned
        await loop.advance(0.2)
        assert len(spawned) == 1

    run_manually(scene)
    for work in spawned:
        work.close()
