"""Share the event loop's time between a server's clients: the client that has used the least time is served first. Pure.

Every client has a :class:`Share`, whose ``work`` handles what the client has sent. Work starts immediately while the clients
together use less than half of the time; beyond that it is queued, and each iteration of the loop handles a few
milliseconds of it.

There are two queues, like the classes in a multilevel feedback scheduler: one for interactive clients, which send little
and then wait for the response, and one for bulk clients, whose work never ends or takes a long time.
Interactive clients are served first, so that none of them waits for a slice of each of 250 clients that flood the server;
bulk clients get at least a fifth of the time.

Each queue uses fair queueing: a client's tag is the time that it has used, a client that was idle starts at the tag
that is currently served, and the client whose work will end first, if it takes as long as before, is served first.
Therefore a client that uses less than its share of the time waits at most for one slice of each other client, and not
for others' long messages. A client with more rights has a larger weight, so that the same time counts less. Source:
Goyal, Vin, Cheng: Start-time Fair Queueing, SIGCOMM 1996.
"""

from __future__ import annotations

import heapq
import itertools
import logging
import time
from collections.abc import Callable
from typing import NamedTuple

__all__ = ["FairTurns", "Share", "cpu_meter"]

_log = logging.getLogger(__name__)

TURN_SECONDS = 0.004  # seconds per loop iteration for the queued work of all clients
# seconds of work for a client before the next client's turn: with 250 clients, each waits 25 ms
SLICE_SECONDS = 0.0001
# A client counts as new for this many jobs, which are expected to take at least as long as other new clients' jobs.
NEW_PIECES = 8
EXPECTED_DECAY = 0.9  # factor by which a client's expected time per job decays after a shorter job
IMMEDIATE_SHARE = 0.5  # fraction of the loop's time that all work may take before further work is queued
# Maximum length of an interactive client's burst of work, in slices (1 ms in total).
# A request takes 0.1 to 0.5 ms to handle; 64 kB of empty frames take 100 ms.
# A new client starts with one slice, and gets one more after each short burst.
# Therefore, if 250 new clients flood the server, the other clients are served after one slice for each new client.
INTERACTIVE_SLICES = 10
# Maximum debt of bulk clients, in TURN_SECONDS: interactive clients can use 200 ms before bulk clients get a slice.
MAX_DEBT_TURNS = 10
# minimum fraction of the time for bulk clients while interactive clients use the rest
BULK_SHARE = 0.2

Work = Callable[[float], bool]
"""A function that works until a time of the clock; it returns whether more work is left."""


class Share:
    """The loop time that a client has used, in seconds divided by the client's weight."""

    __slots__ = (
        "burst",
        "expected",
        "is_closed",
        "is_queued",
        "last_burst",
        "pieces",
        "queue",
        "short_bursts",
        "tag",
        "weight",
        "work",
    )

    def __init__(self, work: Work, queue: _FairQueue) -> None:
        self.work = work
        self.queue = queue  # the queue that contains the client: interactive or bulk
        # seconds used, divided by the weight; a client that becomes active starts at ``queue.served`` or later
        self.tag = queue.served
        self.weight = 1.0  # set when the client's rights are known
        # expected seconds of the client's next job, estimated from earlier ones
        self.expected = 0.0
        self.pieces = 0  # number of jobs done while the client is new
        self.burst = 0.0  # seconds used since the client was idle
        self.last_burst = 0.0  # seconds used in the previous burst
        self.short_bursts = 0  # number of consecutive short bursts, at most INTERACTIVE_SLICES
        self.is_queued = False
        self.is_closed = False


class _Entry(NamedTuple):
    """A queued client, ordered by its tag at the expected end of its next job, then by its used time and its arrival.

    ``start`` is the tag at the job's start.
    """

    end: float
    used: float
    number: int
    start: float
    share: Share


class _FairQueue:
    """A fair queue of clients. There is one for interactive clients and one for bulk clients."""

    def __init__(self) -> None:
        self.entries: list[_Entry] = []  # a heap
        # highest start tag of a job that has run; set to ``highest`` by update() if the queue is empty
        self.served = 0.0
        self.highest = 0.0  # highest tag of a client that has been served

    def update(self) -> None:
        """If the queue is empty, set ``served`` to the highest tag, so that clients that become active now start equal."""
        if not self.entries:
            self.served = self.highest


class FairTurns:
    """Schedules the work of all clients of a server on one event loop."""

    def __init__(
        self,
        call_soon: Callable[[Callable[[], None]], object],
        clock: Callable[[], float],
        *,
        meter: Callable[[], float] | None = None,
        turn: float = TURN_SECONDS,
        slice_: float = SLICE_SECONDS,
    ) -> None:
        """Create the scheduler. ``call_soon`` schedules a call for the next loop iteration; ``clock`` returns seconds.

        ``meter`` returns the seconds used to measure clients' use (default: ``clock``).
        """
        self._call_soon = call_soon
        self._clock = clock
        self._meter = meter or clock
        self._turn_seconds = turn
        self._slice = slice_
        self._credit = turn  # seconds that work may use without being queued
        self._credited = clock()  # when the credit was last updated
        self._new_expected = slice_  # expected seconds of a new client's job
        self._interactive = _FairQueue()
        self._bulk = _FairQueue()
        self._bulk_credit = 0.0  # seconds owed to bulk clients, which go first if this is at least a slice
        self._numbers = itertools.count()
        self._is_running = False  # whether a client's work is running
        self._is_scheduled = False  # True from call_soon() until the callback runs

    def __len__(self) -> int:
        """Return the number of clients with queued work."""
        queues = self._interactive, self._bulk
        return sum(not entry.share.is_closed for queue in queues for entry in queue.entries)

    @property
    def is_busy(self) -> bool:
        """Return whether any client is waiting for its turn."""
        return bool(self._interactive.entries or self._bulk.entries)

    def join(self, work: Work) -> Share:
        """Add a client; return its share, which starts with the same tag as the shares of idle clients."""
        self._interactive.update()
        return Share(work, self._interactive)

    def leave(self, share: Share) -> None:
        """Stop running the work of a client. Idempotent."""
        share.is_closed = True

    def start(self, share: Share) -> bool:
        """Run a client's work now, or queue the client; return whether work is left. Do nothing if it is queued already."""
        if share.is_queued or share.is_closed:
            return share.is_queued
        if self._is_running or self.is_busy or not self._may_start_now():
            self._put(share)
            return True

        before = self._clock()
        if self._run(share, max(share.tag, share.queue.served)):
            self._put(share)
        self._credit -= self._clock() - before
        return share.is_queued

    def _may_start_now(self) -> bool:
        now = self._clock()
        self._credit = min(self._turn_seconds, self._credit + (now - self._credited) * IMMEDIATE_SHARE)
        self._credited = now
        return self._credit > 0

    def _put(self, share: Share) -> None:
        queue = self._queue_of(share)
        queue.update()
        if queue is not share.queue:
            # The tags of one queue have no meaning in the other queue.
            share.queue = queue
            share.tag = queue.served
        share.is_queued = True
        self._push(share, max(share.tag, queue.served))
        if not self._is_scheduled:
            self._is_scheduled = True
            self._call_soon(self._turn)

    def _queue_of(self, share: Share) -> _FairQueue:
        allowed = max(1, share.short_bursts) * self._slice
        is_interactive = share.burst <= allowed and self._is_short(share.last_burst)
        return self._interactive if is_interactive else self._bulk

    def _is_short(self, burst: float) -> bool:
        return burst <= INTERACTIVE_SLICES * self._slice

    def _push(self, share: Share, start: float) -> None:
        # If several jobs would end at the same tag, the client that has used the least time comes first.
        end = self._end_of(share, start)
        heapq.heappush(share.queue.entries, _Entry(end, share.tag, next(self._numbers), start, share))

    def _end_of(self, share: Share, start: float) -> float:
        is_new = share.pieces < NEW_PIECES
        return start + (max(share.expected, self._new_expected) if is_new else share.expected) / share.weight

    def _turn(self) -> None:
        self._is_scheduled = False
        end = self._clock() + self._turn_seconds
        while self.is_busy and self._clock() < end:
            queue = self._next_queue()
            end_tag, *_, start, share = heapq.heappop(queue.entries)
            if self._end_of(share, start) > end_tag + self._slice:
                # A new client's job is now expected to take longer than when it was queued, so queue it again.
                self._push(share, start)
                continue
            share.is_queued = False
            before = self._clock()
            is_left = self._run(share, start)
            self._update_bulk_credit(queue, self._clock() - before)
            if is_left:
                self._put(share)
        if self.is_busy and not self._is_scheduled:
            self._is_scheduled = True
            self._call_soon(self._turn)

    def _next_queue(self) -> _FairQueue:
        if not self._interactive.entries:
            return self._bulk
        return self._bulk if self._bulk.entries and self._bulk_credit >= self._slice else self._interactive

    def _update_bulk_credit(self, queue: _FairQueue, seconds: float) -> None:
        change = -seconds * (1 - BULK_SHARE) if queue is self._bulk else seconds * BULK_SHARE
        # Clamp the credit, so that it does not accumulate over time.
        most = self._turn_seconds
        self._bulk_credit = max(-MAX_DEBT_TURNS * most, min(most, self._bulk_credit + change))

    def _run(self, share: Share, start: float) -> bool:
        """Run some of a client's work, starting at the tag ``start``. Return whether any work is left."""
        if share.is_closed:
            return False
        end, before = self._clock() + self._slice, self._meter()
        share.queue.served = max(share.queue.served, start)
        self._is_running = True
        is_left = False
        try:
            is_left = share.work(end)
        except Exception:  # noqa: BLE001 - a fault in one client's work must not end the turns of the others
            _log.exception("handling what a client has sent")
        self._is_running = False
        used = self._meter() - before
        share.tag = start + used / share.weight
        share.queue.highest = max(share.queue.highest, share.tag)
        share.expected = max(used, EXPECTED_DECAY * share.expected)
        share.burst += used / share.weight
        if not is_left:
            is_short = self._is_short(share.burst)
            share.short_bursts = min(INTERACTIVE_SLICES, share.short_bursts + 1) if is_short else 0
            share.burst, share.last_burst = 0.0, share.burst
        if share.pieces < NEW_PIECES:
            share.pieces += 1
            self._new_expected = max(used, EXPECTED_DECAY * self._new_expected, self._slice)
        return is_left and not share.is_closed


def cpu_meter() -> Callable[[], float]:
    """Return the clock of this thread's CPU time or, if that is too coarse (16 ms on Windows), the monotonic clock.

    By the monotonic clock, a client would also pay for other processes that use the processor during its work.
    """
    is_fine = time.get_clock_info("thread_time").resolution < SLICE_SECONDS / 10
    return time.thread_time if is_fine else time.monotonic
