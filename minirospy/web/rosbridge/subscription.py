"""A client's subscriptions to one topic, merged into one; a rate limit for messages; and received fragments. Pure."""

from __future__ import annotations

import sys
from collections import OrderedDict, deque
from collections.abc import Callable, Hashable, Iterable
from dataclasses import dataclass
from typing import Generic, NamedTuple, TypeVar

from minirospy.web.json_text import width_of
from minirospy.web.rosbridge.protocol import Fragment, OperationError, Subscribe
from minirospy.web.server.queue import DEFAULT_LIMIT, ENTRY_BYTES

__all__ = ["Budget", "Fragments", "Merged", "Pacer", "merge"]

_T = TypeVar("_T")
_STRENGTH = ("none", "png", "cbor", "cbor-raw")

MAX_FRAGMENT_BYTES = 64_000_000
"""Maximum memory in bytes for a client's incomplete messages, with overhead; a wide character takes two or four bytes."""
_MAX_FRAGMENTS = 100_000
_FRAGMENT_BYTES = 200
_MESSAGE_BYTES = 1000
"""Overhead in bytes of each fragment in addition to its text, and of each incomplete message in addition to its fragments."""


@dataclass(frozen=True)
class Merged:
    """The combined parameters of a client's subscriptions to a topic. ``throttle`` is in seconds."""

    throttle: float
    queue_length: int
    fragment_size: int | None
    compression: str


def merge(subscriptions: Iterable[Subscribe]) -> Merged:
    """Combine the subscriptions: the shortest interval, the smallest queue and fragment size, and the strongest compression."""
    each = tuple(subscriptions)
    sizes = [one.fragment_size for one in each if one.fragment_size is not None]
    return Merged(
        min(one.throttle_rate for one in each) / 1000,
        min(one.queue_length for one in each),
        min(sizes, default=None),
        max((one.compression for one in each), key=_STRENGTH.index),
    )


@dataclass
class Budget:
    """The number of bytes queued for a client's rate-limited topics, and its maximum."""

    most: int = DEFAULT_LIMIT
    taken: int = 0


class Pacer(Generic[_T]):
    """Limits a topic's rate to one message per ``throttle`` seconds.

    The newest ``queue_length`` messages are queued; older ones are dropped.
    """

    def __init__(self, budget: Budget, size_of: Callable[[_T], int]) -> None:
        """Create the rate limiter. Other topics may share ``budget``; ``size_of`` returns the size of a message in bytes."""
        self.throttle = 0.0
        self._budget = budget
        self._size_of = size_of
        self.dropped = 0
        self._last = float("-inf")
        self._length = 0
        self._waiting: deque[_T] = deque()

    def set(self, throttle: float, queue_length: int) -> None:
        """Change the interval and the queue length, keeping the newest messages."""
        self.throttle, self._length = throttle, queue_length
        self._trim()

    def arrived(self, message: _T, now: float) -> bool:
        """Return whether to send a message now; if not, queue or drop it."""
        if not self._waiting and now >= self._last + self.throttle:
            self._last = now
            return True
        if self._length:
            self._waiting.append(message)
            self._budget.taken += self._size_of(message) + ENTRY_BYTES
            self._trim()
        else:
            self.dropped += 1
        return False

    @property
    def due(self) -> float | None:
        """Return the time at which the next queued message is due, or None if none is queued."""
        return self._last + self.throttle if self._waiting else None

    def next(self, now: float) -> _T | None:
        """Remove and return the next message if it is due, otherwise return None."""
        if not self._waiting or now < self._last + self.throttle:
            return None
        self._last = now
        return self._popped()

    def clear(self) -> None:
        """Drop all queued messages."""
        while self._waiting:
            self._popped()

    def _popped(self) -> _T:
        message = self._waiting.popleft()
        self._budget.taken -= self._size_of(message) + ENTRY_BYTES
        return message

    def _trim(self) -> None:
        while (count := len(self._waiting)) > self._length or (
            count > 1 and self._budget.taken > self._budget.most
        ):
            self._popped()
            self.dropped += 1


class _Parts(NamedTuple):
    total: int
    parts: dict[int, str]
    since: list[float]

    @property
    def size(self) -> int:
        return _MESSAGE_BYTES + sum(sys.getsizeof(part) + _FRAGMENT_BYTES for part in self.parts.values())


class Fragments:
    """The fragments received for incomplete messages of one client."""

    def __init__(self, timeout: float = 600.0) -> None:
        """Create the collection. An incomplete message is discarded after ``timeout`` seconds."""
        self._timeout = timeout
        # Messages are ordered by the time of their last fragment, oldest first.
        self._messages: OrderedDict[Hashable, _Parts] = OrderedDict()
        self.size = 0
        """Total bytes of memory of the fragments."""

    def add(self, fragment: Fragment, now: float) -> str | None:
        """Add a fragment. Return its message if that is complete now, otherwise None.

        Raise OperationError if the fragment is invalid or too large.
        """
        self._forget_old(now)
        known = self._messages.get(fragment.id)
        if known is None:
            known = self._messages[fragment.id] = _Parts(fragment.total, {}, [now])
            self.size += known.size
        if fragment.total != known.total or fragment.number in known.parts:
            raise OperationError(f"error while trying to append fragment {fragment.number}", fragment.id)
        self.size += sys.getsizeof(fragment.data) + _FRAGMENT_BYTES
        known.parts[fragment.number] = fragment.data
        known.since[0] = now
        self._messages.move_to_end(fragment.id)
        if self.size > MAX_FRAGMENT_BYTES or known.total > _MAX_FRAGMENTS:
            self._forget(fragment.id)
            raise OperationError(
                f"the fragments of message {fragment.id} are too many: {MAX_FRAGMENT_BYTES} bytes and "
                f"{_MAX_FRAGMENTS} fragments may wait",
                fragment.id,
            )

        if len(known.parts) < known.total:
            return None
        self._forget(fragment.id)
        # A single wide character makes all characters of a message wide in memory.
        width = max(map(width_of, known.parts.values()))
        if width * sum(map(len, known.parts.values())) > MAX_FRAGMENT_BYTES:
            raise OperationError(
                f"message {fragment.id} is too large: {MAX_FRAGMENT_BYTES} bytes of memory are allowed, of which each "
                f"character takes {width}",
                fragment.id,
            )
        return "".join(known.parts[number] for number in range(known.total))

    def clear(self) -> None:
        """Discard all incomplete messages."""
        self._messages.clear()
        self.size = 0

    def _forget_old(self, now: float) -> None:
        while self._messages:
            id_, oldest = next(iter(self._messages.items()))
            if now - oldest.since[0] <= self._timeout:
                return
            self._forget(id_)

    def _forget(self, id_: Hashable) -> None:
        self.size -= self._messages.pop(id_).size
