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
"""Maximum memory, in bytes, for one client's incomplete messages, including overhead. A wide character takes two or four
bytes.
"""
_MAX_FRAGMENTS = 100_000
_FRAGMENT_BYTES = 200
_MESSAGE_BYTES = 1000
"""Bytes of overhead of each fragment, beyond its text, and of each incomplete message, beyond its fragments."""


@dataclass(frozen=True)
class Merged:
    """The merged parameters of a client's subscriptions to one topic; ``throttle`` is in seconds."""

    throttle: float
    queue_length: int
    fragment_size: int | None
    compression: str


def merge(subscriptions: Iterable[Subscribe]) -> Merged:
    """Merge the subscriptions: the shortest interval, the smallest queue and fragment size, and the strongest compression."""
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
    """The number of bytes that a client's rate-limited topics have queued, and the maximum."""

    most: int = DEFAULT_LIMIT
    taken: int = 0


class Pacer(Generic[_T]):
    """Limits a topic's rate to one message per ``throttle`` seconds.

    The newest ``queue_length`` messages are queued; older ones are dropped.
    """

    def __init__(self, budget: Budget, size_of: Callable[[_T], int]) -> None:
        """Create the rate limiter. ``budget`` may be shared with other topics; ``size_of`` returns a message's size in bytes."""
        self.throttle = 0.0
        self._budget = budget
        self._size_of = size_of
        self.dropped = 0
        self._last = float("-inf")
        self._length = 0
        self._waiting: deque[_T] = deque()

    def set(self, throttle: float, queue_length: int) -> None:
        """Change the interval and the queue length. The newest messages are kept."""
        self.throttle, self._length = throttle, queue_length
        self._trim()

    def arrived(self, message: _T, now: float) -> bool:
        """Return whether to send a message now. Otherwise it is queued or dropped."""
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
        """Return the time at which to send the next queued message, or None if there is none."""
        return self._last + self.throttle if self._waiting else None

    def next(self, now: float) -> _T | None:
        """Remove and return a message that is due, or return None if there is none."""
        if not self._waiting or now < self._last + self.throttle:
            return None
        self._last = now
        return self._popped()

    def clear(self) -> None:
        """Drop the queued messages."""
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
    """The fragments of one client's incomplete messages."""

    def __init__(self, timeout: float = 600.0) -> None:
        """Create the collection. ``timeout``: seconds after which an incomplete message is discarded."""
        self._timeout = timeout
        # The messages are ordered by the time of their last fragment, oldest first.
        self._messages: OrderedDict[Hashable, _Parts] = OrderedDict()
        self.size = 0
        """Total bytes of memory of the fragments."""

    def add(self, fragment: Fragment, now: float) -> str | None:
        """Add a fragment. Return the message that it completes, or None if the message is still incomplete.

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
        # One wide character makes all characters of the message wide in memory.
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
