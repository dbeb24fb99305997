"""Hostile peers in a fleet, and peers that leave: no task fails, no table fills up, and no data is lost permanently."""

from __future__ import annotations

import asyncio
import json
from types import SimpleNamespace
from typing import Any, cast

import pytest
import yaml

from minirospy.base.errors import BridgeError
from minirospy.fleet import inquiry
from minirospy.fleet.exporter import _MAX_READERS, _MAX_WANTED, Exporter
from minirospy.fleet.imported_topic import ImportedTopic
from minirospy.fleet.importer import Importer
from minirospy.fleet.inbound import InboundTopic
from minirospy.fleet.keys import (
    Claim,
    Offer,
    TopicToken,
    Want,
    definition_key,
    parse_definition,
    topic_key,
    want_key,
)
from minirospy.fleet.network import _CONTROL_QUERIES, _QUERIES
from minirospy.fleet.report import Answer, as_json, lines, parse_answer
from minirospy.fleet.rules import GatewayRules, Priority
from minirospy.fleet.sender import _MAX_OUTLETS, Receiver, Sender
from tests.waiting import until

MD5 = "0123456789abcdef" * 2
CLAIM = Claim("robot1", "0" * 16, 1, "1" * 16)
TOKEN = TopicToken("robot1", "0" * 16, "/chat", "std_msgs/String", MD5, False, True)


def stub(**fields: object) -> Any:
    """Return an object that has only these attributes."""
    return SimpleNamespace(**fields)


class Closing:
    """A link whose close blocks until it is released."""

    def __init__(self, token: TopicToken, gate: asyncio.Event) -> None:
        self.token = token
        self.is_idle = False
        self.closed = 0
        self._gate = gate

    async def close(self) -> None:
        self.closed += 1
        await self._gate.wait()


def exporter(spawned: list[Any]) -> Exporter:
    return Exporter(stub(), stub(), stub(), stub(), stub(), CLAIM, GatewayRules(), list, spawned.append)


def test_topics_that_end_together_are_closed_once_each() -> None:
    async def check() -> None:
        made, gate = exporter([]), asyncio.Event()
        links = {name: Closing(TOKEN._replace(topic=name), gate) for name in ("/a", "/b", "/c")}
        made.outbound = cast(Any, dict(links))
        others = {name: Closing(TOKEN._replace(topic=name), gate) for name in ("/d", "/e", "/f")}
        made.inbound = cast(Any, dict(others))
        tasks = [asyncio.ensure_future(made._adjust()) for _ in range(3)]
        await asyncio.sleep(0)
        gate.set()
        await asyncio.gather(*tasks)
        assert [link.closed for link in (*links.values(), *others.values())] == [1] * 6

    asyncio.run(check())


def test_wants_of_peers_are_limited() -> None:
    spawned: list[Any] = []
    made = exporter(spawned)
    for number in range(_MAX_WANTED + 5):
        made._want_changed(want_key("robot1", "0" * 16, Want(f"/t{number}", "0" * 16)), True)
    for number in range(_MAX_READERS + 5):
        made._want_changed(want_key("robot1", "0" * 16, Want("/t0", f"{number:016x}")), True)
    assert (len(made._readers), len(made._readers["/t0"])) == (_MAX_WANTED, _MAX_READERS)
    for work in spawned:
        work.close()


def test_a_full_table_of_flows_makes_room_for_a_new_writer() -> None:
    flows = Receiver.flows(2)
    first, second = flows.of("first"), flows.of("second")
    assert first
    assert second
    assert flows.of("first") is first
    assert flows.of("third") is not None
    assert flows.of("first") is first

    first.waiting.append((1, cast(Any, None)))
    third = flows.of("third")
    assert third
    third.waiting.append((1, cast(Any, None)))
    assert flows.of("fourth") is None


def test_readers_that_come_and_go_leave_no_publishers_behind() -> None:
    there: list[str] = []

    def outlet(key: str, _: Priority) -> Any:
        there.append(key)
        return stub(put=lambda *_, **__: None, undeclare=lambda: there.remove(key))

    sender = Sender(stub(outlet=outlet))
    flow = sender.flow(Priority.DATA)
    for number in range(3 * _MAX_OUTLETS):
        sender._priorities[Priority.DATA]._put(flow, f"reader{number}", b"")
        sender._priorities[Priority.DATA]._put(flow, "all", b"")
    assert len(there) == len(flow._outlets) == len(flow._numbers) == _MAX_OUTLETS
    assert flow._numbers["all"] == 3 * _MAX_OUTLETS


def test_a_topic_that_is_closed_while_its_type_is_queried_is_not_published() -> None:
    async def check() -> None:
        answered = asyncio.Event()
        advertised: list[object] = []

        async def interface(*_: object) -> Any:
            await answered.wait()

        tasks: list[asyncio.Task[None]] = []
        node = stub(advertise=lambda *args, **_: advertised.append(args))
        topic = InboundTopic(
            node,
            stub(interface=interface),
            TOKEN,
            lambda work: tasks.append(asyncio.ensure_future(work)),
            False,
        )
        topic.offer_changed(Offer("/chat", "2" * 16, "std_msgs/String", MD5, False), True)
        await asyncio.sleep(0)
        await topic.close()
        answered.set()
        await asyncio.gather(*tasks)
        assert not advertised

    asyncio.run(check())


def test_publisher_that_returns_immediately_is_received() -> None:
    async def check() -> None:
        gate, sent = asyncio.Event(), []
        made = [
            stub(close=gate.wait, headers=[]),
            stub(close=gate.wait, headers=[]),
        ]
        flows = iter(
            [
                stub(close=lambda: None, send=None),
                stub(close=lambda: None, send=lambda *_, **__: sent.append(1)),
            ]
        )
        shared = stub(
            node=stub(name="/control", subscribe_raw=lambda *_, **__: made.pop(0)),
            rules=GatewayRules(),
            sender=stub(flow=lambda *_: next(flows)),
            definitions=stub(learn=lambda *_: None),
            gateway="3" * 16,
        )
        topic = ImportedTopic(shared, TOKEN, lambda: None)
        topic._subscribe()
        leaving = asyncio.ensure_future(topic._unsubscribe())
        await asyncio.sleep(0)
        topic._subscribe()
        gate.set()
        await leaving
        topic._heard(cast(Any, b"data"), cast(Any, {"callerid": "/other", "md5sum": MD5}))
        assert sent == [1]

    asyncio.run(check())


def test_a_query_is_answered_whatever_its_handler_raises() -> None:
    pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")
    from minirospy.fleet.network import FleetNetwork

    async def check() -> None:
        network = FleetNetwork(stub(close=lambda: None), asyncio.get_running_loop())
        replies: list[bytes] = []
        dropped: list[int] = []
        query = stub(key_expr="a/b", payload=None, reply_err=replies.append, drop=lambda: dropped.append(1))

        async def fails(_: str, __: bytes) -> bytes:
            raise ZeroDivisionError

        async def hangs(_: str, __: bytes) -> bytes:
            await asyncio.Event().wait()
            return b""

        await network._answer(query, fails)
        assert (replies, dropped) == ([b"the gateway failed: ZeroDivisionError"], [1])
        network._start_answer(query, hangs, network._calls)
        await asyncio.sleep(0)
        await network.close()
        assert dropped == [1, 1]

    asyncio.run(check())


@pytest.mark.parametrize("type_", ["..%..%etc%passwd", "os.path%x", "%std_msgs%String", "std_msgs"])
def test_only_names_of_types_are_looked_up_for_a_peer(type_: str) -> None:
    good = definition_key("0" * 16, "std_msgs/String", MD5)
    assert parse_definition(good) == ("std_msgs/String", MD5)
    assert parse_definition(good.replace("std_msgs%String", type_)) is None
    assert parse_definition(good.replace(MD5, "*")) is None


def nested(levels: int) -> bytes:
    return b"[" * levels + b"]" * levels


@pytest.mark.parametrize(
    "status",
    [
        b'{"robots": [{"links": [{"topic": "x", "delay": 1' + b"0" * 400 + b"}]}]}",
        b'{"machine": ' + nested(900) + b"}",
        b'{"machine": "\\ud800"}',
        b'{"topics": NaN, "services": 1e999}',
    ],
)
def test_a_status_that_is_hostile_is_printed(status: bytes) -> None:
    answer = Answer(CLAIM, parse_answer(status))
    assert "\n".join(lines([answer], [answer])).encode()
    assert json.loads(as_json([answer], [answer]))


def test_a_parameter_that_is_nested_deeply_is_one_line() -> None:
    def network(data: bytes) -> Any:
        async def tokens(*_: object) -> list[str]:
            return [f"@minirospy/1/robot/robot1/{'0' * 16}/1/{'1' * 16}"]

        async def query(*_: object, **__: object) -> bytes:
            return data

        return stub(tokens=tokens, query=query)

    with pytest.raises(BridgeError, match="nested too deeply"):
        asyncio.run(inquiry.robot_parameter(network(nested(900)), "robot1", "/x", 1.0))
    value = asyncio.run(inquiry.robot_parameter(network(nested(40)), "robot1", "/x", 1.0))
    assert yaml.safe_dump(value)


def test_an_answer_that_is_too_long_is_named_as_such() -> None:
    zenoh = pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")
    from minirospy.fleet.network import MAX_TEXT, FleetNetwork, QueryFailed

    class Long:
        def __len__(self) -> int:
            return MAX_TEXT + 1

    def get(_: str, handler: Any, **__: object) -> None:
        handler.callback(stub(ok=stub(key_expr="a", payload=Long())))
        handler.drop()

    async def check() -> None:
        network = FleetNetwork(stub(close=lambda: None, get=get), asyncio.get_running_loop())
        with pytest.raises(QueryFailed, match="more than"):
            await network.query("a", seconds=1.0)
        await network.close()

    assert zenoh.handlers.Callback
    asyncio.run(check())


def test_calls_that_wait_do_not_hold_up_pings_and_reports() -> None:
    pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")
    from minirospy.fleet.network import FleetNetwork

    class Query:
        """A peer's query; ``answer`` is its reply."""

        key_expr, payload = "a/b", None

        def __init__(self) -> None:
            self.answer: asyncio.Future[bytes] = loop.create_future()

        def reply(self, _: object, data: bytes) -> None:
            loop.call_soon_threadsafe(self.answer.set_result, data)

        def reply_err(self, data: bytes) -> None:
            self.reply(None, data)

        def drop(self) -> None:
            pass

    async def check() -> None:
        nonlocal loop
        loop = asyncio.get_running_loop()
        arrived: dict[str, Any] = {}

        def declare_queryable(key: str, handler: Any, **_: object) -> Any:
            arrived[key] = handler.callback
            return stub(undeclare=lambda: None)

        network = FleetNetwork(stub(close=lambda: None, declare_queryable=declare_queryable), loop)

        async def hangs(_: str, __: bytes) -> bytes:
            await asyncio.Event().wait()
            return b""

        async def pong(_: str, __: bytes) -> bytes:
            return b"pong"

        network.answer("call", hangs)
        network.answer("ping", pong, is_control=True)
        network.answer("status", hangs, is_control=True)
        await until(lambda: len(arrived) == 3)

        queries = [Query() for _ in range(_QUERIES + 1)]
        for query in queries:
            arrived["call"](query)
        assert await queries[-1].answer == f"the gateway is answering {_QUERIES} other queries".encode()
        # The other queries in the burst are answered.
        assert not any(query.answer.done() for query in queries[:-1])
        ping = Query()
        arrived["ping"](ping)
        assert await ping.answer == b"pong"

        # Pings and reports do not use the slots for calls, either.
        queries = [Query() for _ in range(_CONTROL_QUERIES + 1)]
        for query in queries:
            arrived["status"](query)
        assert (
            await queries[-1].answer == f"the gateway is answering {_CONTROL_QUERIES} other queries".encode()
        )
        await network.close()

    loop: asyncio.AbstractEventLoop
    asyncio.run(asyncio.wait_for(check(), 60))


def test_names_that_are_left_out_are_reported_in_one_line(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("minirospy.fleet.contents.MAX_TOKENS", 0)
    made = Importer(
        stub(), stub(), stub(), stub(), stub(), "0" * 16, "", GatewayRules(), lambda _: None, lambda: 0
    )
    for number in range(100):
        made._changed(topic_key(TOKEN._replace(topic=f"/t{number}")), True)
    assert [record.getMessage() for record in caplog.records] == [
        "what a gateway announces is not shown: the fleet announces more than 0 topics and services"
    ]
