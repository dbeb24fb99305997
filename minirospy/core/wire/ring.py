"""The ring of shared memory that carries large messages between two processes on one machine: its words and its places.

The publisher writes a message into a *place* of the ring, once for all subscribers, and announces it on each subscriber's socket.
A subscriber copies the message and releases the place. This module makes the decisions;
:mod:`minirospy.runtime.transport.ring_sender` owns the memory. Source: docs/shared_memory.md.
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Hashable
from dataclasses import dataclass, field
from enum import Enum, auto
from typing import NamedTuple

from minirospy.base.errors import WireError
from minirospy.core.wire.framing import check_split

__all__ = [
    "ANNOUNCEMENT_BYTES",
    "ANSWERS",
    "MAPPED",
    "MAX_MESSAGE",
    "MAX_RING",
    "MIN_MESSAGE",
    "OFFER_BYTES",
    "OFFER_WORD",
    "PLACE_WORD",
    "PREPARE_WORD",
    "READY",
    "REFUSED",
    "Announcement",
    "Layout",
    "Places",
    "Step",
    "announcement",
    "layout_for",
    "offer",
    "parse_announcement",
    "parse_offer",
    "prepare",
]

# Words sent in place of a frame's length. They are greater than any frame length, split or not.
PREPARE_WORD = 0xC0000001  # the publisher wants to offer a ring
OFFER_WORD = 0xC0000002  # the ring's size follows; the ring's file descriptors are sent with these bytes
PLACE_WORD = 0xC0000003  # a message's offset and size, its array's size, and the size of the fields after the array follow

# Bytes with which a subscriber answers the publisher
READY = b"r"  # answer to PREPARE_WORD: the subscriber now receives file descriptors
MAPPED = b"m"  # answer to OFFER_WORD: the subscriber has mapped the ring and will read from it
REFUSED = b"n"  # answer to OFFER_WORD: the subscriber cannot map the ring

# The minimum size, in bytes, of a message that is sent through a ring, measured with one subscriber.
# At 0.9 MB (VGA), the ring saves 6 % of the time and 5 % of the CPU time; at 6 MB, a quarter of both.
MIN_MESSAGE = 500_000

MAX_RING = 64 * 1024 * 1024  # maximum bytes per topic; enough for two 4K images (25 MB each)
MAX_PLACES = 16  # maximum places per ring; enough for a few subscribers, but fits the processor's cache
MIN_PLACES = 2  # minimum places per ring: one to write to while a subscriber reads the other
PAGE = 64 * 1024  # bytes; the largest page size of common Linux machines, so that no two places share a page
MAX_MESSAGE = MAX_RING // MIN_PLACES  # maximum bytes of a message that is sent through a ring

# Maximum bytes of messages that one subscriber may hold at a time; a Unix socket buffers at most this much.
# Beyond this, messages for a slow subscriber wait in the publisher's queue, where the oldest may be dropped.
MAX_HELD = 4 * 1024 * 1024
ALWAYS_HELD = 2  # places that a subscriber may hold regardless of size: one to read, one waiting

_WORD = struct.Struct("<I")
_OFFER = struct.Struct("<II")
_ANNOUNCEMENT = struct.Struct("<IIIII")
OFFER_BYTES = _OFFER.size - _WORD.size  # bytes that follow OFFER_WORD
ANNOUNCEMENT_BYTES = _ANNOUNCEMENT.size - _WORD.size  # bytes that follow PLACE_WORD


class Announcement(NamedTuple):
    """A message's location in the ring. ``array`` and ``rest`` are those of a split frame, or 0 for a message in one part."""

    offset: int
    size: int
    array: int
    rest: int


def prepare() -> bytes:
    """Return the bytes that ask a subscriber to prepare for file descriptors."""
    return _WORD.pack(PREPARE_WORD)


def offer(ring_size: int) -> bytes:
    """Return the bytes that offer a ring; the ring's file descriptors must be sent with them."""
    return _OFFER.pack(OFFER_WORD, ring_size)


def parse_offer(data: bytes) -> int:
    """Return the ring's size from the bytes after :data:`OFFER_WORD`. Raise WireError if the size exceeds the limit."""
    (size,) = _WORD.unpack(data)
    if not 0 < size <= MAX_RING:
        raise WireError(f"a ring of {size} bytes is over the limit of {MAX_RING}")
    return int(size)


def announcement(offset: int, size: int, array: int = 0, rest: int = 0) -> bytes:
    """Return the bytes that announce a message in the ring."""
    return _ANNOUNCEMENT.pack(PLACE_WORD, offset, size, array, rest)


def parse_announcement(data: bytes, ring_size: int) -> Announcement:
    """Parse the bytes after :data:`PLACE_WORD`. Raise WireError if the message or its array lies outside its bounds."""
    offset, size, array, rest = struct.unpack("<IIII", data)
    if offset + size > ring_size:
        raise WireError(f"a message of {size} bytes at {offset} is outside the ring of {ring_size} bytes")
    if array or rest:
        check_split(size, array, rest)
    return Announcement(offset, size, array, rest)


class Step(Enum):
    """The state of the ring's setup at the publisher's end of a connection."""

    NEW = auto()  # no ring yet, or a replaced one; the next large message sends PREPARE_WORD
    ASKED = auto()  # PREPARE_WORD was sent
    LISTENING = auto()  # the subscriber can receive file descriptors; the next large message sends OFFER_WORD
    OFFERED = auto()  # OFFER_WORD was sent
    IN_USE = auto()  # the subscriber reads messages from the ring
    OFF = auto()  # the subscriber refused the ring, or released more places than it held


ANSWERS: dict[tuple[Step, bytes], Step] = {
    (Step.ASKED, READY): Step.LISTENING,
    (Step.OFFERED, MAPPED): Step.IN_USE,
    (Step.OFFERED, REFUSED): Step.OFF,
}
"""The next step after a subscriber's answer. All other bytes are ignored."""


class Layout(NamedTuple):
    """The division of a ring into places: their number, and the size of each in bytes."""

    place_size: int
    places: int

    @property
    def size(self) -> int:
        """The ring's size in bytes."""
        return self.place_size * self.places


def layout_for(size: int) -> Layout:
    """Return the layout for messages of up to ``size`` bytes (at most :data:`MAX_MESSAGE`), with a quarter in reserve.

    Because of the reserve, a slightly longer message does not need a new ring.
    """
    place_size = min(MAX_MESSAGE, -(-(size + size // 4) // PAGE) * PAGE)
    return Layout(place_size, min(MAX_PLACES, MAX_RING // place_size))


@dataclass
class Places:
    """Tracks which places of a ring are free, and which connections hold the others.

    A place is either free or has holders: the thread that fills it, and each connection on which it was announced. A connection
    releases its places in the order of their announcements. The place that was freed last is reused first, because it is still in
    the processor's cache. Not thread-safe.
    """

    count: int
    _free: list[int] = field(init=False)
    _holders: list[int] = field(init=False)  # the number of holders of each place
    # for each connection: the announced places that are not released yet, oldest first, with the sizes of their messages
    _held: dict[Hashable, deque[tuple[int, int]]] = field(init=False)

    def __post_init__(self) -> None:
        self._free = list(range(self.count))[::-1]
        self._holders = [0] * self.count
        self._held = {}

    @property
    def free(self) -> tuple[int, ...]:
        """The places without a holder."""
        return tuple(self._free)

    def take(self) -> int | None:
        """Return a free place, which the caller holds until :meth:`let_go`, or None if every place is held."""
        if not self._free:
            return None
        place = self._free.pop()
        self._holders[place] = 1
        return place

    def let_go(self, place: int) -> None:
        """Release a place that :meth:`take` has returned."""
        self._holders[place] -= 1
        if not self._holders[place]:
            self._free.append(place)

    def may_hold(self, connection: Hashable, size: int) -> bool:
        """Return whether a connection may hold one more place, for a message of ``size`` bytes."""
        held = self._held.get(connection, ())
        return len(held) < ALWAYS_HELD or sum(each for _, each in held) + size <= MAX_HELD

    def hold(self, connection: Hashable, place: int, size: int) -> None:
        """Add a connection as a holder of a place that the caller has taken."""
        self._held.setdefault(connection, deque()).append((place, size))
        self._holders[place] += 1

    def take_back(self, connection: Hashable) -> None:
        """Undo a connection's last :meth:`hold`, because the place was not announced.

        Do nothing if the connection holds no place: a subscriber may have released more than was announced.
        """
        if held := self._held.get(connection):
            self.let_go(held.pop()[0])

    def release(self, connection: Hashable, count: int) -> bool:
        """Release a connection's oldest ``count`` places. If it holds fewer, release none and return False."""
        held = self._held.get(connection, deque())
        if count > len(held):
            return False
        for _ in range(count):
            self.let_go(held.popleft()[0])
        return True

    def held_by(self, connection: Hashable) -> int:
        """Return the number of places that a connection holds."""
        return len(self._held.get(connection, ()))
