"""runtime/master/notifier: nodes that do not answer share a few slots, and keep the others waiting no longer."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from minirospy.errors import RpcError, RpcUnreachable
from minirospy.graph.registry import PublisherUpdate
from minirospy.runtime.master import notifier as notifier_module
from minirospy.runtime.master.notifier import Notifier
from minirospy.runtime.rpc.turns import Turns
from tests.manual_loop import ManualLoop, run_manually

ANSWER = b"<methodResponse/>"
DEAD = [f"http://dead{number}:1/" for number in range(6)]
ALIVE = [f"http://alive{number}:1/" for number in range(6)]


class Scene:
    """A notifier whose calls the test answers."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(notifier_module, "_CALLS_AT_ONCE", 4)
        monkeypatch.setattr(notifier_module, "_CALLS_TO_SUSPECTS", 1)
        self.under_way: dict[str, Callable[[bytes | RpcError], None]] = {}
        self.notifier = Notifier(self, Turns(), timeout=3.0)  # type: ignore[arg-type]
        monkeypatch.setattr(self.notifier._rpc, "begin", self.begin)

    def publisher_uris(self, topic: str) -> list[str]:
        return []

    def begin(self, uri: str, body: Any, timeout: float, done: Callable[[Any], None]) -> None:
        self.under_way[uri] = done

    def notify(self, uris: list[str], topic: str) -> None:
        for uri in uris:
            self.notifier.send(PublisherUpdate(uri, topic))

    async def answer(self, clock: ManualLoop, uris: list[str], *, is_dead: bool) -> None:
        """Answer all calls to ``uris``, one after the other, as they are made."""
        left = set(uris)
        while left:
            await clock.advance(0.01)
            now = left & self.under_way.keys()
            assert now
            for uri in now:
                self.under_way.pop(uri)(RpcUnreachable(uri, "timed out") if is_dead else ANSWER)
            left -= now


def test_nodes_that_did_not_answer_have_few_slots_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    async def scene(clock: ManualLoop) -> None:
        scene = Scene(monkeypatch)
        scene.notify(DEAD, "/t")
        await clock.advance(0.01)
        assert len(scene.under_way) == 4
        await scene.answer(clock, DEAD, is_dead=True)

        scene.notify(DEAD, "/t2")
        await clock.advance(0.01)
        assert list(scene.under_way) == DEAD[:1]
        scene.notify(ALIVE, "/t2")
        await clock.advance(0.01)
        assert list(scene.under_way) == [DEAD[0], *ALIVE[:4]]
        await scene.answer(clock, ALIVE, is_dead=False)
        await scene.notifier.close()

    run_manually(scene)


def test_a_node_that_answers_again_has_a_full_share_again(monkeypatch: pytest.MonkeyPatch) -> None:
    async def scene(clock: ManualLoop) -> None:
        scene = Scene(monkeypatch)
        scene.notify(DEAD, "/t")
        await scene.answer(clock, DEAD, is_dead=True)
        scene.notify(DEAD, "/t2")
        await scene.answer(clock, DEAD, is_dead=False)

        scene.notify(DEAD, "/t3")
        await clock.advance(0.01)
        assert list(scene.under_way) == DEAD[:4]
        await scene.notifier.close()

    run_manually(scene)
