"""Reaching a ROS 2 server before sending the actual request: the conditions and the time limits."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from concurrent.futures import Future
from typing import Any

from minirospy.base.errors import BridgeError
from minirospy.ros2.reach import Reach
from tests.manual_loop import ManualLoop, run_manually
from tests.ros2.test_ros2_bridge import FakeProbe, FakeReachable


def of(scene: Callable[[ManualLoop, FakeReachable, Reach], Coroutine[Any, Any, None]], **client: Any) -> None:
    async def run(loop: ManualLoop) -> None:
        reachable = FakeReachable(**client)
        reach = Reach(reachable)
        try:
            await scene(loop, reachable, reach)
        finally:
            await reach.close()

    run_manually(run)


def test_a_request_waits_until_one_without_effect_is_answered() -> None:
    probe = FakeProbe(answers=False)

    async def scene(loop: ManualLoop, _: FakeReachable, reach: Reach) -> None:
        waiting = asyncio.ensure_future(reach.wait())
        for sent, pause in enumerate((0.5, 1.0, 2.0), 1):
            await loop.advance(0)
            assert len(probe.reaching) == sent
            await loop.advance(pause)
        assert not waiting.done()
        assert all(each.cancelled() for each in probe.reaching[:3])
        probe.reaching[-1].set_result(None)
        await waiting
        assert probe.closed == 1
        await asyncio.wait_for(reach.wait(), 1)
        assert len(probe.reaching) == 4

    of(scene, prober=probe)


def test_requests_wait_ten_seconds_at_most_in_all() -> None:
    async def scene(loop: ManualLoop, client: FakeReachable, reach: Reach) -> None:
        first = asyncio.ensure_future(reach.wait())
        await loop.advance(6)
        second = asyncio.ensure_future(reach.wait())
        await loop.advance(3)
        assert not first.done()
        assert not second.done()
        await loop.advance(1)
        assert first.done()
        assert second.done()
        await asyncio.wait_for(reach.wait(), 1)

        # Probing continues: a server that was only busy will still respond.
        assert client.prober
        client.prober.answers = True
        await loop.advance(8)
        assert client.prober.closed == 1

    of(scene, prober=FakeProbe(answers=False))


def test_a_later_server_without_answers_delays_requests_by_ten_seconds() -> None:
    async def scene(loop: ManualLoop, client: FakeReachable, reach: Reach) -> None:
        assert client.prober
        await reach.wait(60)
        client.servers = frozenset({b"2"})
        client.prober.answers = False
        waiting = asyncio.ensure_future(reach.wait(60))
        await loop.advance(9.9)
        assert not waiting.done()
        await loop.advance(0.1)
        assert waiting.done()

    of(scene)


def test_server_is_reached_after_a_silent_one_has_left() -> None:
    async def scene(loop: ManualLoop, client: FakeReachable, reach: Reach) -> None:
        crashed = client.prober
        assert crashed
        reach.start()
        await loop.advance(10)
        # The parameter services of a node that has exited never become connected.
        other = client.prober = FakeProbe(answers=False)
        client.servers = frozenset({b"2"})
        waiting = asyncio.ensure_future(reach.wait())
        await loop.advance(0)
        await loop.advance(0.02)
        assert crashed.closed == 1
        assert other.reaching
        assert not waiting.done()
        other.reaching[-1].set_result(None)
        await waiting

    of(scene, prober=FakeProbe(is_ready=False))


def test_a_server_that_comes_later_is_reached_too() -> None:
    async def scene(_: ManualLoop, client: FakeReachable, reach: Reach) -> None:
        assert client.prober
        await reach.wait()
        client.servers = frozenset({b"1", b"2"})
        await reach.wait()
        assert len(client.prober.reaching) == 2
        client.servers = frozenset({b"2"})
        await reach.wait()
        assert len(client.prober.reaching) == 2

    of(scene)


def test_a_server_without_anything_to_reach_it_by_gets_a_second() -> None:
    async def scene(loop: ManualLoop, client: FakeReachable, reach: Reach) -> None:
        waiting = asyncio.ensure_future(reach.wait())
        await loop.advance(0.9)
        assert not waiting.done()
        await loop.advance(0.2)
        await waiting
        await asyncio.wait_for(reach.wait(), 1)

        client.servers = frozenset({b"2"})
        waiting = asyncio.ensure_future(reach.wait())
        await loop.advance(0.5)
        client.prober = FakeProbe()
        await loop.advance(0.02)
        await waiting

    of(scene, prober=None)


def test_no_wait_if_no_response_is_lost() -> None:
    async def scene(_: ManualLoop, client: FakeReachable, reach: Reach) -> None:
        reach.start()
        await asyncio.wait_for(reach.wait(), 1)
        assert client.prober
        assert not client.prober.reaching

    of(scene, servers=None)


def test_a_client_is_reached_once_it_and_its_probe_are_connected() -> None:
    async def scene(loop: ManualLoop, client: FakeReachable, reach: Reach) -> None:
        assert client.prober
        reach.start()
        await loop.advance(20)
        client.is_ready = True
        await loop.advance(0.02)
        assert not client.prober.reaching
        client.prober.is_ready = True
        await loop.advance(0.02)
        assert client.prober.reaching
        await asyncio.wait_for(reach.wait(), 1)

    of(scene, is_ready=False, prober=FakeProbe(is_ready=False))


def test_a_probe_that_fails_is_sent_again_after_a_pause() -> None:
    class Failing(FakeProbe):
        def reach(self) -> Future[None]:
            failed = super().reach()
            failed.set_exception(BridgeError("no"))
            return failed

    probe = Failing(answers=False)

    async def scene(loop: ManualLoop, _: FakeReachable, reach: Reach) -> None:
        reach.start()
        for sent, pause in ((1, 0.5), (2, 1.0)):
            await loop.advance(0)
            assert len(probe.reaching) == sent
            await loop.advance(pause)

    of(scene, prober=probe)


def test_waiting_calls_return_at_shutdown() -> None:
    async def scene(loop: ManualLoop, client: FakeReachable, reach: Reach) -> None:
        waiting = asyncio.ensure_future(reach.wait())
        await loop.advance(0)
        await reach.close()
        await waiting
        assert client.prober
        assert client.prober.closed == 1

    of(scene, prober=FakeProbe(answers=False))


def test_a_request_after_the_end_waits_for_nothing_and_starts_nothing() -> None:
    async def scene(_: ManualLoop, client: FakeReachable, reach: Reach) -> None:
        before = asyncio.all_tasks()
        await reach.close()
        await asyncio.wait_for(reach.wait(), 1)
        assert asyncio.all_tasks() == before
        assert client.prober
        assert not client.prober.reaching

    of(scene)
