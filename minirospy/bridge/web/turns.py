"""Share the event loop between the clients of a server: the client that has used the least of it goes first. Pure.

Every client has a :class:`Share`, whose ``work`` handles what the client has sent. Work starts immediately while the clients
together use less than half of the time; beyond that it is queued, and each iteration of the loop handles a few
milliseconds of it. The order is start-time fair queueing: a client's tag is the time that it has used, and a client that was
idle starts at the tag that is served now. So a client that uses less than its part of the time waits at most for one slice of
each other client. A client that may write has a larger weight: the same time counts less. Source: Goyal, Vin, Cheng: Start-time
Fair Queueing, SIGCOMM 1996.
"""

from __future__ import annotations

import heapq
import itertools
import logging
import time
from collections.abc import Callable

__all__ = ["WRITER_WEIGHT", "FairTurns", "Share", "cpu_meter"]

_log = logging.getLogger(__name__)

TURN_SECONDS = 0.004  # of each iteration of the loop, for the queued work of all clients together
SLICE_SECONDS = 0.0001  # of one client before the next client's work: 250 of them are a wait of 25 ms
WRITER_WEIGHT = 16.0  # of a client that may drive a robot: it goes before clients that may only look
IMMEDIATE_SHARE = 0.5  # of the time, for work that starts without being queued

Work = Callable[[float], bool]
"""Do some work, up to a time of the clock; return whether more is left."""


class Share:
    """The part of the loop that one client has used."""

    __slots__ = ("is_closed", "is_queued", "tag", "weight", "work")

    def __init__(self, work: Work, tag: float) -> None:
        self.work = work
        self.tag = tag
        """Seconds that the client has used, by its weight; at least the tag that was served when it last started."""
        self.weight = 1.0
        self.is_queued = False
        self.is_closed = False


class FairTurns:
    """The work of all clients of a server. Used on one event loop."""

    def __init__(
        self,
        call_soon: Callable[[Callable[[], None]], object],
        clock: Callable[[], float],
        *,
        meter: Callable[[], float] | None = None,
        turn: float = TURN_SECONDS,
        slice_: float = SLICE_SECONDS,
    ) -> None:
        """``call_soon`` has a function called in the next iteration of the loop; ``clock`` returns seconds.

        ``meter`` returns the seconds by which a client's use is measured, by default those of ``clock``.
        """
        self._call_soon = call_soon
        self._clock = clock
        self._meter = meter or clock
        self._turn_seconds = turn
        self._slice = slice_
        self._served = 0.0
        # The tag of the work that was started last.
        self._credit = turn
        # Seconds of work that may start without being queued.
        self._credited = clock()
        self._queue: list[tuple[float, float, int, Share]] = []
        self._numbers = itertools.count()
        self._is_running = self._is_scheduled = False

    def __len__(self) -> int:
        """Return the number of clients whose work is queued."""
        return sum(not share.is_closed for *_, share in self._queue)

    def join(self, work: Work) -> Share:
        """Return the share of a new client: it has no advantage over clients that have been idle."""
        return Share(work, self._served)

    def leave(self, share: Share) -> None:
        """Start its work no more. Idempotent."""
        share.is_closed = True

    def start(self, share: Share) -> bool:
        """Do a client's work now or in its turn; return whether some is left. Without effect while it is queued."""
        if share.is_queued or share.is_closed:
            return share.is_queued
        if self._is_running or self._queue or not self._may_start_now():
            self._put(share)
            return True

        start = self._clock()
        if self._run(share, self._slice):
            self._put(share)
        self._credit -= self._clock() - start
        return share.is_queued

    def _may_start_now(self) -> bool:
        now = self._clock()
        self._credit = min(self._turn_seconds, self._credit + (now - self._credited) * IMMEDIATE_SHARE)
        self._credited = now
        return self._credit > 0

    def _put(self, share: Share) -> None:
        share.is_queued = True
        # Of clients that start at the same tag the one that used less before goes first.
        tag = max(share.tag, self._served)
        heapq.heappush(self._queue, (tag, share.tag, next(self._numbers), share))
        if not self._is_scheduled:
            self._is_scheduled = True
            self._call_soon(self._turn)

    def _turn(self) -> None:
        self._is_scheduled = False
        end = self._clock() + self._turn_seconds
        while self._queue and self._clock() < end:
            share = heapq.heappop(self._queue)[-1]
            share.is_queued = False
            if self._run(share, self._slice):
                self._put(share)
        if self._queue and not self._is_scheduled:
            self._is_scheduled = True
            self._call_soon(self._turn)

    def _run(self, share: Share, seconds: float) -> bool:
        """Do some of a client's work; return whether more is left."""
        if share.is_closed:
            return False
        end, start = self._clock() + seconds, self._meter()
        self._served = max(self._served, share.tag)
        self._is_running = True
        is_left = False
        try:
            is_left = share.work(end)
        except Exception:  # noqa: BLE001 - a fault in one client's work must not end the turns of the others
            _log.exception("handling what a client has sent")
        self._is_running = False
        share.tag = max(share.tag, self._served) + (self._meter() - start) / share.weight
        return is_left and not share.is_closed


def cpu_meter() -> Callable[[], float]:
    """Return the clock of this thread's CPU time, or the monotonic one where the former ticks too slowly (Windows: 16 ms).

    By the time of day a client would pay for other processes, which take the processor while its work is done.
    """
    is_fine = time.get_clock_info("thread_time").resolution < SLICE_SECONDS / 10
    return time.thread_time if is_fine else time.monotonic
