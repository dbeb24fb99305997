"""runtime/node/node: a node registers and unregisters everything with a slow master, and does not wait for a dead one."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Sequence
from typing import Any

import pytest

from minirospy.base.environment import Environment
from minirospy.base.errors import RpcFault, RpcUnreachable
from minirospy.core.wire.tcpros import InterfaceType
from minirospy.runtime.node import registration
from minirospy.runtime.node.node import Node
from minirospy.runtime.node.publication import Publication
from minirospy.runtime.rpc.async_client import AsyncRpcClient
from minirospy.runtime.rpc.server import RpcServer
from minirospy.runtime.transport.loop import new_event_loop
from tests.manual_loop import ManualLoop, run_manually, until

STRING = InterfaceType("std_msgs/String", "992ce8a1687cec8c8bd883ec73ca41d1", "string data\n")
TOPICS = 5


class FakeMaster:
    """Records calls and responds to them after a pause; ``multicall``: whether it supports system.multicall."""

    def __init__(self, *, multicall: bool, seconds: float = 0.0) -> None:
        self.calls: list[tuple[str, Sequence[Any]]] = []
        self.seconds = seconds
        self.release = asyncio.Event()
        self.release.set()
        self._has_multicall = multicall
        self.server = RpcServer(self.dispatch)

    async def __aenter__(self) -> FakeMaster:
        await self.server.start()
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.server.close()

    @property
    def uri(self) -> str:
        return f"http://127.0.0.1:{self.server.port}"

    @property
    def unregistered(self) -> list[str]:
        return sorted(args[1] for method, args in self.calls if method.startswith("unregister"))

    async def dispatch(self, method: str, args: Sequence[Any]) -> Any:
        self.calls.append((method, args))
        if not method.startswith("register"):
            await self.release.wait()
            await asyncio.sleep(self.seconds)
        if method == "system.multicall":
            if not self._has_multicall:
                raise RpcFault(1, "no such method")
            self.calls += [(call["methodName"], call["params"]) for call in args[0]]
            return [[[1, "", 1]] for _ in args[0]]
        return [1, "", []]


def run(scene: Callable[[], Coroutine[Any, Any, None]]) -> None:
    loop = new_event_loop()
    try:
        loop.run_until_complete(asyncio.wait_for(scene(), 30))
    finally:
        loop.run_until_complete(loop.shutdown_asyncgens())
        loop.close()


async def publishing_node(uri: str) -> Node:
    node = Node("/node", Environment.read({"ROS_MASTER_URI": uri, "ROS_IP": "127.0.0.1"}), watch_seconds=60)
    await node.start()
    for number in range(TOPICS):
        await node.advertise(Publication(f"/t{number}", STRING))
    return node


ALL = [f"/t{number}" for number in range(TOPICS)]


def test_close_unregisters_all_names_in_one_call() -> None:
    async def scene() -> None:
        async with FakeMaster(multicall=True) as master:
            node = await publishing_node(master.uri)
            node.parameters.add("/p")
            master.calls.clear()
            await node.close()
            (method, _), *inside = master.calls
            assert method == "system.multicall"
            assert inside == [
                *(("unregisterPublisher", ["/node", topic, node.uri]) for topic in ALL),
                ("unsubscribeParam", ["/node", node.uri, "/p"]),
            ]

    run(scene)


def test_close_makes_single_calls_without_multicall() -> None:
    async def scene() -> None:
        async with FakeMaster(multicall=False) as master:
            node = await publishing_node(master.uri)
            await node.close()
            assert master.unregistered == ALL

    run(scene)


def test_close_repeats_what_a_multicall_did_not_do() -> None:
    async def scene() -> None:
        async with FakeMaster(multicall=True) as master:
            node = await publishing_node(master.uri)
            dispatch = master.dispatch

            async def refuse_most(method: str, args: Sequence[Any]) -> Any:
                answer = await dispatch(method, args)
                if method == "system.multicall":
                    master.calls = master.calls[: 1 - TOPICS]
                    answer[1:] = [{"faultCode": 1, "faultString": "too long"}] * (TOPICS - 1)
                return answer

            master.server.dispatch = refuse_most
            await node.close()
            assert master.unregistered == ALL

    run(scene)


def test_close_waits_for_a_master_that_answers_slowly() -> None:
    async def scene() -> None:
        async with FakeMaster(multicall=False, seconds=0.3) as master:
            node = await publishing_node(master.uri)
            await node.close()
            assert master.unregistered == ALL

    run(scene)


def test_registration_waits_for_a_master_that_is_busy_for_20_seconds() -> None:
    async def scene() -> None:
        async with FakeMaster(multicall=True) as master:
            node = await publishing_node(master.uri)
            loop = asyncio.get_running_loop()
            arrived, passed = asyncio.Event(), 0.0
            clock = loop.time
            loop.time = lambda: clock() + passed  # type: ignore[method-assign]
            dispatch = master.dispatch

            async def answer_late(method: str, args: Sequence[Any]) -> Any:
                arrived.set()
                await master.release.wait()
                return await dispatch(method, args)

            master.server.dispatch = answer_late
            master.release.clear()
            registering = asyncio.ensure_future(node.advertise(Publication("/late", STRING)))
            await arrived.wait()
            passed = 20.0
            # Everything that is due runs in this iteration.
            await asyncio.sleep(0.01)
            master.release.set()
            await registering
            await node.close()

    run(scene)


def test_close_sends_the_unregistration_before_it_flushes() -> None:
    async def scene() -> None:
        async with FakeMaster(multicall=True) as master:
            node = await publishing_node(master.uri)
            master.release.clear()
            closing = asyncio.ensure_future(node.close())
            await until(lambda: "system.multicall" in [method for method, _ in master.calls])
            assert not closing.done()
            master.release.set()
            await closing

    run(scene)


def test_close_unregisters_a_name_after_the_call_under_way() -> None:
    async def scene() -> None:
        async with FakeMaster(multicall=True) as master:
            node = await publishing_node(master.uri)
            master.calls.clear()
            master.release.clear()
            publication = node.publications["/t0"]
            leaving = asyncio.ensure_future(node.unadvertise(publication))
            await until(lambda: master.calls)
            closing = asyncio.ensure_future(node.close())
            await until(lambda: len(master.calls) >= 2)
            master.release.set()
            await asyncio.gather(leaving, closing)
            assert master.unregistered == ALL

    run(scene)


def test_close_waits_for_a_master_that_is_busy_for_minutes() -> None:
    """The master has other nodes to unregister, but responds to short calls."""

    async def scene(clock: ManualLoop) -> None:
        async with FakeMaster(multicall=True) as master:
            node = await publishing_node(master.uri)
            busy, dispatch = asyncio.Event(), master.dispatch

            async def answer_short_calls(method: str, args: Sequence[Any]) -> Any:
                if method == "system.multicall":
                    await busy.wait()
                return await dispatch(method, args)

            master.server.dispatch = answer_short_calls
            closing = asyncio.ensure_future(node.close())
            for number in range(40):
                await clock.advance(3.0)
                await until(lambda number=number: _count(master, "getPid") > number)  # type: ignore[misc]
                assert not closing.done()
            busy.set()
            await closing
            assert master.unregistered == ALL

    run_manually(scene)


def _count(master: FakeMaster, method: str) -> int:
    return [name for name, _ in master.calls].count(method)


def test_close_ends_a_watch_whose_cancellation_is_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    """Before Python 3.12, asyncio.wait_for loses it if the response arrives at the same moment."""

    async def scene() -> None:
        async with FakeMaster(multicall=True) as master:
            node = await publishing_node(master.uri)
            registrations = node.registrations
            registrations.watch_seconds = 0.0
            looking = asyncio.Event()

            async def lose(awaitable: Coroutine[Any, Any, Any], _: float) -> None:
                awaitable.close()
                looking.set()
                try:
                    await asyncio.sleep(60)
                except asyncio.CancelledError:
                    return

            with monkeypatch.context() as patch:
                patch.setattr(registration.asyncio, "wait_for", lose)
                assert registrations.watching
                registrations.watching.cancel()
                registrations.watch()
                await looking.wait()
                await node.close()

    run(scene)


def test_close_gives_up_on_a_master_that_is_silent(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(registration, "SILENT_SECONDS", 0.2)
    monkeypatch.setattr(registration, "NOTICE_SECONDS", 0.1)

    async def scene() -> None:
        async with FakeMaster(multicall=True) as master:
            node = await publishing_node(master.uri)
            master.release.clear()
            await node.close()
            assert not master.unregistered
            master.release.set()

    run(scene)
    assert "waiting for the master at" in caplog.text


def test_close_returns_when_the_unregistration_is_stopped(caplog: pytest.LogCaptureFixture) -> None:
    async def scene() -> None:
        async with FakeMaster(multicall=True) as master:
            node = await publishing_node(master.uri)
            master.release.clear()
            closing = asyncio.ensure_future(node.close(announces=False))
            await asyncio.sleep(0)
            # The time limit for a silent master would be longer than the test's.
            node.stop_unregistering()
            await closing
            assert not master.unregistered
            master.release.set()

    run(scene)
    assert not caplog.text


def test_close_does_not_wait_for_a_master_that_refuses_connections() -> None:
    async def scene() -> None:
        async with FakeMaster(multicall=True) as master:
            node = await publishing_node(master.uri)
        # The time limit for a silent master would be longer than the test's.
        await node.close()

    run(scene)


def test_close_ends_what_remains_after_a_part_that_fails(caplog: pytest.LogCaptureFixture) -> None:
    async def scene() -> None:
        async with FakeMaster(multicall=True) as master:
            node = await publishing_node(master.uri)
            uri = node.uri
            closed = []

            def fail() -> None:
                raise ValueError("Invalid file descriptor: -1")

            for topic in ALL[:2]:
                node.publications[topic].close = fail  # type: ignore[method-assign]
            node.publications[ALL[2]].close = lambda: closed.append(ALL[2])  # type: ignore[method-assign]
            await node.close()
            assert closed == [ALL[2]]
            assert master.unregistered == ALL
            with pytest.raises(RpcUnreachable):
                await AsyncRpcClient().call(uri, "getPid", "/test")

    run(scene)
    assert caplog.text.count("ValueError: Invalid file descriptor: -1") == 2
