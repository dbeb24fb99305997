"""The ring of shared memory that carries large messages between two processes of one machine: its words and its places.

The publisher writes a message into a *place* of the ring, once for all subscribers, and announces it on each subscriber's
socket. A subscriber copies the message and releases the place. This module decides;
:mod:`minirospy.runtime.transport.shared_memory` owns the memory. Source: docs/shared_memory.md.
"""

from __future__ import annotations

import re
import struct
from collections import deque
from collections.abc import Hashable
from dataclasses import dataclass, field
from enum import Enum, auto
from typing import NamedTuple

from minirospy.base.errors import WireError

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
    "LargeMessages",
    "Layout",
    "Places",
    "Step",
    "announcement",
    "layout_for",
    "offer",
    "parse_announcement",
    "parse_large_messages",
    "parse_offer",
    "prepare",
]

# Words in place of a frame's length: they are greater than any frame's length, split or not
PREPARE_WORD = 0xC0000001  # the publisher wants to offer a ring
OFFER_WORD = 0xC0000002  # the ring's size follows; its file descriptors come with these bytes
PLACE_WORD = 0xC0000003  # a message is in the ring: its offset, its size and its trailing array's size follow

# Bytes that a subscriber sends to the publisher
READY = b"r"  # the answer to PREPARE_WORD: from now on it receives file descriptors
MAPPED = b"m"  # the answer to OFFER_WORD: it reads places from now on
REFUSED = b"n"  # the answer to OFFER_WORD: it cannot map the ring

# Bytes of the shortest message for a ring. Measured: with one subscriber, a ring's bookkeeping costs as much CPU time as it
# saves at 0.9 MB (VGA), and saves a quarter at 6 MB.
MIN_MESSAGE = 1_000_000

MAX_RING = 64 * 1024 * 1024  # bytes per topic; enough for two images of 4K (25 MB)
MAX_PLACES = 16  # per ring: more than a few subscribers hold, and few enough to stay in the processor's cache
MIN_PLACES = 2  # one is written while another is read
PAGE = 64 * 1024  # bytes; the largest page size of a common Linux machine, so that places share no page
MAX_MESSAGE = MAX_RING // MIN_PLACES  # bytes of the longest message for a ring

# Bytes of messages that one subscriber may hold at a time: as much as a Unix socket buffers at most.
# Beyond it, a slow subscriber's messages wait in the publisher's queue, where the drop rule applies.
MAX_HELD = 4 * 1024 * 1024
ALWAYS_HELD = 2  # places that one subscriber may hold whatever their size: one is read while another waits

_WORD = struct.Struct("<I")
_OFFER = struct.Struct("<II")
_ANNOUNCEMENT = struct.Struct("<IIII")
OFFER_BYTES = _OFFER.size - _WORD.size  # after the word
ANNOUNCEMENT_BYTES = _ANNOUNCEMENT.size - _WORD.size  # after the word


# The end of a connection's text in getBusInfo; it comes from another process, so its length and its characters are limited
_LARGE_MESSAGES = re.compile(
    r"; (\d{1,18}) of (\d{1,18}) large messages by shared memory(?:: ([ -~]{1,200}))?\Z"
)


class LargeMessages(NamedTuple):
    """How many of a connection's large messages went through a ring, and why the others did not ("" if most did)."""

    shared: int
    all: int
    why: str = ""

    @property
    def text(self) -> str:
        """The end of a connection's text in getBusInfo; :func:`parse_large_messages` reads it."""
        return f"; {self.shared} of {self.all} large messages by shared memory" + (
            f": {self.why}" if self.why else ""
        )


def parse_large_messages(info: str) -> LargeMessages | None:
    """Parse the end of a connection's text in getBusInfo. Return None if it does not mention large messages."""
    match = _LARGE_MESSAGES.search(info)
    return LargeMessages(int(match[1]), int(match[2]), match[3] or "") if match else None


class Announcement(NamedTuple):
    """Where a message is in the ring: its offset, its size, and the size of the byte array that ends it (0: no split)."""

    offset: int
    size: int
    tail: int


def prepare() -> bytes:
    """Return the bytes that ask a subscriber to receive file descriptors."""
    return _WORD.pack(PREPARE_WORD)


def offer(ring_size: int) -> bytes:
    """Return the bytes that offer a ring; its file descriptors are sent with them."""
    return _OFFER.pack(OFFER_WORD, ring_size)


def parse_offer(data: bytes) -> int:
    """Return the ring's size from the bytes after :data:`OFFER_WORD`. Raise WireError if it is over the limit."""
    (size,) = _WORD.unpack(data)
    if not 0 < size <= MAX_RING:
        raise WireError(f"a ring of {size} bytes is over the limit of {MAX_RING}")
    return int(size)


def announcement(offset: int, size: int, tail: int) -> bytes:
    """Return the bytes that announce a message in the ring."""
    return _ANNOUNCEMENT.pack(PLACE_WORD, offset, size, tail)


def parse_announcement(data: bytes, ring_size: int) -> Announcement:
    """Parse the bytes after :data:`PLACE_WORD`. Raise WireError if the message is not inside the ring."""
    offset, size, tail = struct.unpack("<III", data)
    if offset + size > ring_size:
        raise WireError(f"a message of {size} bytes at {offset} is outside the ring of {ring_size} bytes")
    if tail and tail > size - 4:
        raise WireError(f"a message of {size} bytes says that it ends with an array of {tail}")
    return Announcement(offset, size, tail)


class Step(Enum):
    """How far the publisher's end of a connection is with its ring."""

    NEW = auto()  # no ring, or an old one: the next large message sends PREPARE_WORD
    ASKED = auto()  # PREPARE_WORD is sent
    LISTENING = auto()  # the subscriber receives file descriptors: the next large message sends OFFER_WORD
    OFFERED = auto()  # OFFER_WORD is sent
    IN_USE = auto()  # the subscriber reads places
    OFF = auto()  # the subscriber refused, or released more than it held


ANSWERS: dict[tuple[Step, bytes], Step] = {
    (Step.ASKED, READY): Step.LISTENING,
    (Step.OFFERED, MAPPED): Step.IN_USE,
    (Step.OFFERED, REFUSED): Step.OFF,
}
"""The step after a subscriber's answer. Any other byte is ignored."""


class Layout(NamedTuple):
    """The places of a ring: the size of each in bytes, and their number."""

    place_size: int
    places: int

    @property
    def size(self) -> int:
        """The ring's size in bytes."""
        return self.place_size * self.places


def layout_for(size: int) -> Layout:
    """Return the layout for messages of up to ``size`` bytes (at most :data:`MAX_MESSAGE`) and a quarter more.

    The quarter avoids a new ring for each slightly longer message.
    """
    place_size = min(MAX_MESSAGE, -(-(size + size // 4) // PAGE) * PAGE)
    return Layout(place_size, min(MAX_PLACES, MAX_RING // place_size))


@dataclass
class Places:
    """Which places of a ring are free, and which connections hold the others.

    A place is free, or it has at least one holder: the thread that fills it, and each connection it was announced on. A
    connection releases its places in the order of its announcements. A place that became free last is used first, because
    it is still in the processor's cache. Not thread-safe.
    """

    count: int
    _free: list[int] = field(init=False)
    _holders: list[int] = field(init=False)  # the number of holders of each place
    # for each connection: the places that were announced and not released, oldest first, with the sizes of their messages
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
        """Return a free place, held for the thread that fills it until :meth:`let_go`; None if no place is free."""
        if not self._free:
            return None
        place = self._free.pop()
        self._holders[place] = 1
        return place

    def let_go(self, place: int) -> None:
        """End the hold of :meth:`take`."""
        self._holders[place] -= 1
        if not self._holders[place]:
            self._free.append(place)

    def may_hold(self, connection: Hashable, size: int) -> bool:
        """Return whether a connection may hold one more place with a message of ``size`` bytes."""
        held = self._held.get(connection, ())
        return len(held) < ALWAYS_HELD or sum(each for _, each in held) + size <= MAX_HELD

    def hold(self, connection: Hashable, place: int, size: int) -> None:
        """Let a connection hold a place that its caller has taken."""
        self._held.setdefault(connection, deque()).append((place, size))
        self._holders[place] += 1

    def take_back(self, connection: Hashable) -> None:
        """Undo the last :meth:`hold` of a connection: the place was not announced.

        Do nothing if the connection holds no place: a subscriber may have released more than was announced.
        """
        if held := self._held.get(connection):
            self.let_go(held.pop()[0])

    def release(self, connection: Hashable, count: int) -> bool:
        """Release the oldest ``count`` places of a connection. Return False, and release none, if it holds fewer."""
        held = self._held.get(connection, deque())
        if count > len(held):
            return False
        for _ in range(count):
            self.let_go(held.popleft()[0])
        return True

    def held_by(self, connection: Hashable) -> int:
        """Return the number of places that a connection holds."""
        return len(self._held.get(connection, ()))
