"""Publishing at a rate, with a clock that the test controls."""

from __future__ import annotations

import threading
from types import SimpleNamespace
from typing import Any

from minirospy.base.errors import ROSTimeMovedBackwardsException
from minirospy.introspect.publishing import publish_all

SECOND = 10**9


class Hand:
    """A clock that each sleep advances, except that the sleep with number ``jump`` sets it back to ``to``."""

    def __init__(self, jump: int, to: int) -> None:
        self.time = 100 * SECOND
        self._left = jump
        self._to = to

    def now(self) -> int:
        return self.time

    def sleep(self, nanoseconds: int, stop: threading.Event) -> bool:
        assert nanoseconds <= SECOND, "no pause is longer than the rate requires"
        self._left -= 1
        if not self._left:
            self.time = self._to
            raise ROSTimeMovedBackwardsException(1.0)
        self.time += nanoseconds
        return not stop.is_set()


def sent_by(clock: Any, published: Any = None) -> list[int]:
    """Return the seconds at which five messages are published at 1 Hz."""
    times: list[int] = []

    def publish(_: Any) -> None:
        times.append(clock.time // SECOND)
        if published:
            published()

    node: Any = SimpleNamespace(clock=clock, ended=threading.Event())
    publisher: Any = SimpleNamespace(publish=publish)
    publish_all(node, publisher, range(5), 1.0, lambda _: None)
    return times


def test_time_that_jumps_back_during_a_pause() -> None:
    assert sent_by(Hand(jump=3, to=50 * SECOND)) == [100, 101, 102, 50, 51]


def test_time_that_jumps_back_between_the_pauses() -> None:
    clock = Hand(jump=0, to=0)

    def jump() -> None:
        if clock.time == 102 * SECOND:
            clock.time = 50 * SECOND

    assert sent_by(clock, jump) == [100, 101, 102, 50, 51]
