"""The output queue of one client: first in, first out, limited in size. It always keeps the newest message of each topic.

Pure. A message is queued under a key (its topic or subscription). If the limit is exceeded, the key's own oldest message
is dropped, then the oldest message of the key with the most bytes, so that a camera does not displace small messages.
Responses (``put_answer``) are never dropped: the caller disconnects a client that does not read them. Sizes are bytes in
memory: a message's and that of its entry in the queue, which is larger than a small message.
"""

from __future__ import annotations

from collections import Counter, OrderedDict, deque
from collections.abc import Hashable
from typing import TYPE_CHECKING, NamedTuple

from minirospy.web.server.account import LARGE_PIECE, Piece, Share

if TYPE_CHECKING:
    from minirospy.web.server.files import FileAnswer

__all__ = ["DEFAULT_LIMIT", "ENTRY_BYTES", "MAX_ANSWERS", "Piece", "SendQueue"]

DEFAULT_LIMIT = 10_000_000
"""Maximum size in bytes of the messages queued for a client."""

ENTRY_BYTES = 350
"""Memory in bytes that an entry takes in addition to its pieces: 340 to 360 were measured with Python 3.11."""

MAX_ANSWERS = 64_000_000
"""Maximum size in bytes of the responses queued for a client that does not read them."""


_FILE_BYTES = 1000
"""Memory in bytes of a queued file that is not open, including the queue entry."""


class _Entry(NamedTuple):
    """A queued message, or a response if ``key`` is None. ``size`` is the size in bytes of the pieces and the entry."""

    key: Hashable | None
    pieces: tuple[Piece, ...] | FileAnswer
    size: int


class _Waiting:
    """The queued messages with the same key."""

    __slots__ = ("numbers", "size")

    def __init__(self) -> None:
        self.numbers: deque[int] = deque()
        self.size = 0


class SendQueue:
    """The output queue of one client: messages, which may be dropped, and responses, in order of arrival."""

    def __init__(
        self, limit: int = DEFAULT_LIMIT, entry_bytes: int = ENTRY_BYTES, share: Share | None = None
    ) -> None:
        """Create a queue for ``limit`` bytes of messages. Each message takes an additional ``entry_bytes``.

        A single message may be larger, and is then the only one in the queue. Large pieces are counted in ``share``.
        """
        self.limit = limit
        self.size = 0
        """Bytes of the queued messages, including their entries."""
        self.answers = 0
        """Bytes of the queued responses, including their entries."""
        self.large = 0
        """Bytes of large pieces in messages and responses, which are counted in the share."""
        self.sent = 0
        """Number of messages removed by :meth:`pop`."""
        self.sent_bytes = 0
        self.dropped = 0
        """Number of messages that were dropped in favour of newer ones."""
        self.dropped_of: Counter[Hashable] = Counter()
        """Number of dropped messages per key, for the keys in use."""
        self._share = share
        self._entry_bytes = entry_bytes
        self._number = 0
        self._entries: OrderedDict[int, _Entry] = OrderedDict()
        self._waiting: dict[Hashable, _Waiting] = {}

    def __len__(self) -> int:
        """Return the number of queued messages and responses."""
        return len(self._entries)

    @property
    def is_overrun(self) -> bool:
        """Return whether so many responses are queued that the client has evidently stopped reading."""
        return self.answers > MAX_ANSWERS

    def put(self, key: Hashable, pieces: tuple[Piece, ...], *, newest_only: bool = False) -> None:
        """Append a message to the queue.

        Drop older messages if the limit is exceeded. With ``newest_only`` the message replaces all older messages of its key,
        which do not count as dropped.
        """
        size = sum(map(len, pieces)) + self._entry_bytes
        waiting = self._waiting.get(key)
        if waiting is None:
            waiting = self._waiting[key] = _Waiting()

        while waiting.numbers and newest_only:
            self._remove_oldest(key)
        while waiting.numbers and self.size + size > self.limit:
            self._drop_oldest(key)
        while self.size and self.size + size > self.limit:
            self._drop_oldest(max(self._waiting, key=lambda each: self._waiting[each].size))

        self._number += 1
        if size >= LARGE_PIECE:
            self._hold(pieces)
        self._entries[self._number] = _Entry(key, pieces, size)
        self._waiting.setdefault(key, waiting)
        waiting.numbers.append(self._number)
        waiting.size += size
        self.size += size

    def put_answer(self, pieces: tuple[Piece, ...]) -> None:
        """Append a response, which is never dropped, to the queue."""
        size = sum(map(len, pieces)) + self._entry_bytes
        self._number += 1
        if size >= LARGE_PIECE:
            self._hold(pieces)
        self._entries[self._number] = _Entry(None, pieces, size)
        self.answers += size

    def put_file(self, answer: FileAnswer) -> None:
        """Append a file to the queue. It is never dropped, and is not read until it is popped."""
        self._number += 1
        self._entries[self._number] = _Entry(None, answer, _FILE_BYTES)
        self.answers += _FILE_BYTES

    def pop(self) -> tuple[Piece, ...] | FileAnswer | None:
        """Remove the oldest entry; return its pieces or its file, or None if the queue is empty."""
        if not self._entries:
            return None
        _, entry = self._entries.popitem(last=False)
        if entry.size >= LARGE_PIECE:
            self._release(entry)
        if entry.key is None:
            self.answers -= entry.size
            return entry.pieces
        waiting = self._waiting[entry.key]
        waiting.numbers.popleft()
        self._shrunk(entry.key, waiting, entry.size)
        self.sent += 1
        self.sent_bytes += entry.size - self._entry_bytes
        return entry.pieces

    def discard(self, key: Hashable) -> None:
        """Remove the messages with a key that is no longer used. They do not count as dropped."""
        self.dropped_of.pop(key, None)
        waiting = self._waiting.pop(key, None)
        if waiting:
            for number in waiting.numbers:
                self._release(self._entries.pop(number))
            self.size -= waiting.size

    def drop_messages(self) -> None:
        """Drop all messages, but keep the responses."""
        for key in list(self._waiting):
            while key in self._waiting:
                self._drop_oldest(key)

    def clear(self) -> None:
        """Remove all messages and responses. They do not count as dropped."""
        if self.large:
            for entry in self._entries.values():
                self._release(entry)
        self._entries.clear()
        self._waiting.clear()
        self.size = self.answers = 0

    def _drop_oldest(self, key: Hashable) -> None:
        self.dropped += 1
        self.dropped_of[key] += 1
        self._remove_oldest(key)

    def _remove_oldest(self, key: Hashable) -> None:
        waiting = self._waiting[key]
        entry = self._entries.pop(waiting.numbers.popleft())
        if entry.size >= LARGE_PIECE:
            self._release(entry)
        self._shrunk(key, waiting, entry.size)

    def _hold(self, pieces: tuple[Piece, ...]) -> None:
        self.large += _large(pieces)
        if self._share:
            self._share.hold(pieces)

    def _release(self, entry: _Entry) -> None:
        if isinstance(entry.pieces, tuple):
            self.large -= _large(entry.pieces)
            if self._share:
                self._share.release(entry.pieces)

    def _shrunk(self, key: Hashable, waiting: _Waiting, size: int) -> None:
        waiting.size -= size
        self.size -= size
        if not waiting.numbers:
            self._waiting.pop(key, None)


def _large(pieces: tuple[Piece, ...]) -> int:
    """Return the total size in bytes of the large pieces among ``pieces``."""
    return sum(size for size in map(len, pieces) if size >= LARGE_PIECE)
