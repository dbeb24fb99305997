"""Reads messages from several bags in time order. A thread reads ahead, so that due messages do not wait for the disk."""

from __future__ import annotations

import heapq
import queue
import threading
from collections import deque
from collections.abc import Collection, Iterable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import NamedTuple

from minirospy.base.clock import SignalSafeEvent, SignalSafeQueue
from minirospy.base.errors import BagError, BagUnindexedError, NotFoundError
from minirospy.core.bag.base import BagReader, StoredMessage
from minirospy.core.bag.mcap_reader import open_bag_or_mcap
from minirospy.core.bag.records import Connection

__all__ = ["Bags", "ReadAhead", "Selection", "open_reader"]

_BATCH = 500
_BATCH_BYTES = 4 * 1024 * 1024
_BATCHES = 8


class Selection(NamedTuple):
    """The messages to play: those of the topics (empty: all) between the times ``start`` and ``end`` (None: no limit)."""

    topics: Collection[str] = ()
    start: int | None = None
    end: int | None = None


class Bags:
    """Several bags opened for reading, as a context manager.

    Raise NotFoundError if a file does not exist, BagError with the file's name if a file cannot be read.
    """

    def __init__(self, paths: Iterable[str]) -> None:
        self._files = ExitStack()
        self.readers: list[BagReader] = []
        with ExitStack() as opened:
            for path in paths:
                try:
                    self.readers.append(open_reader(Path(path), opened))
                except FileNotFoundError as error:
                    raise NotFoundError("bag", path) from error
                except BagUnindexedError as error:
                    raise BagError(f"{path}: {error}. Run `rosbag reindex {path}`") from error
                except BagError as error:
                    raise BagError(f"{path}: {error}") from error
            self._files = opened.pop_all()

    def __enter__(self) -> Bags:
        return self

    def __exit__(self, *_: object) -> None:
        self._files.close()

    def connections(self, selection: Selection) -> list[tuple[int, Connection]]:
        """Return the connections with messages to play, each with its bag's index."""
        return [
            (number, connection)
            for number, reader in enumerate(self.readers)
            for connection in reader.connections.values()
            if not selection.topics or connection.topic in selection.topics
        ]

    def times(self) -> tuple[int, int] | None:
        """Return the first and last message's times across all bags, or None if there are no messages."""
        spans = [span for reader in self.readers if (span := _span(reader))]
        return (min(start for start, _ in spans), max(end for _, end in spans)) if spans else None

    def last_time(self, selection: Selection) -> int:
        """Return the last message's time in a non-empty selection, reading only a few chunks."""
        return max(_last_time(reader, selection) for reader in self.readers)

    def messages(self, selection: Selection) -> Iterator[tuple[int, StoredMessage]]:
        """Yield the messages in time order, each with its bag's index. Raise BagFormatError if a bag is damaged."""
        return heapq.merge(
            *(_numbered(number, reader, selection) for number, reader in enumerate(self.readers)),
            key=_time,
        )

    def last_latched(self, selection: Selection) -> list[tuple[int, StoredMessage]]:
        """Return each latched connection's last message before the selection starts."""
        found: list[tuple[int, StoredMessage]] = []
        for number, connection in self.connections(selection):
            if not connection.latching or not selection.start:
                continue
            reader = self.readers[number]
            newest = deque(reader.messages([connection.id], None, selection.start - 1), maxlen=1)
            found += [(number, message) for message in newest]
        return sorted(found, key=_time)


def open_reader(path: Path, opened: ExitStack) -> BagReader:
    """Return a reader for a bag or an MCAP file. Closing ``opened`` closes the reader.

    Raise OSError if the file cannot be read, BagError if the file is invalid.
    """
    stream = opened.enter_context(path.open("rb"))
    reader = open_bag_or_mcap(stream)
    opened.callback(reader.close)
    reader.prepare()
    return reader


class ReadAhead:
    """An iterator over messages that a thread reads ahead, up to a few thousand. Iterate once, then close."""

    def __init__(self, messages: Iterator[tuple[int, StoredMessage]]) -> None:
        self._ready: SignalSafeQueue[list[tuple[int, StoredMessage]] | Exception | None] = SignalSafeQueue(
            _BATCHES
        )
        self._stop = SignalSafeEvent()
        self._first = SignalSafeEvent()
        self._thread = threading.Thread(
            target=self._read, args=(messages,), name="rosbag-reader", daemon=True
        )
        self._thread.start()

    def __iter__(self) -> Iterator[tuple[int, StoredMessage]]:
        """Yield the messages. Re-raise any exception that occurred while reading them."""
        while (item := self._ready.get()) is not None:
            if isinstance(item, Exception):
                raise item
            yield from item

    def wait(self) -> None:
        """Wait until the first messages have been read or the end is reached."""
        self._first.wait()

    def close(self) -> None:
        """Ask the thread to stop."""
        self._stop.set()

    def join(self) -> None:
        """After :meth:`close`, wait until the thread has stopped and no longer uses the files."""
        self._thread.join()

    def _read(self, messages: Iterator[tuple[int, StoredMessage]]) -> None:
        try:
            batch: list[tuple[int, StoredMessage]] = []
            size = 0
            for item in messages:
                batch.append(item)
                size += len(item[1].body)
                if len(batch) >= _BATCH or size >= _BATCH_BYTES:
                    self._put(batch)
                    batch, size = [], 0
                    if self._stop.is_set():
                        return
            self._put(batch)
            self._put(None)
        except Exception as error:  # noqa: BLE001 - re-raised by __iter__
            self._put(batch)
            self._put(error)

    def _put(self, item: list[tuple[int, StoredMessage]] | Exception | None) -> None:
        while not self._stop.is_set():
            try:
                self._ready.put(item, timeout=0.1)
            except queue.Full:
                continue
            finally:
                self._first.set()
            return


def _span(reader: BagReader) -> tuple[int, int] | None:
    if reader.chunks:
        return min(chunk.start_time for chunk in reader.chunks), max(
            chunk.end_time for chunk in reader.chunks
        )
    indexes = [index for index in reader.index(reader.connections) if len(index)]
    if not indexes:
        return None
    return min(index.times[0] for index in indexes), max(index.times[-1] for index in indexes)


def _last_time(reader: BagReader, selection: Selection) -> int:
    """Return the last message's time in a selection, or 0 if there are no messages."""
    wanted = _wanted(reader, selection)
    end = selection.end
    found = {chunk.start_time for chunk in reader.chunks if end is None or chunk.start_time <= end}
    # A bag without chunks has no chunk start times, so read all its messages.
    starts: list[int | None] = [*sorted(found, reverse=True)] or [selection.start]
    for start in starts:
        newest = deque(reader.messages(wanted, start, end), maxlen=1) if wanted else ()
        for message in newest:
            return message.time
        end = None if start is None else start - 1
    return 0


def _wanted(reader: BagReader, selection: Selection) -> list[int]:
    """Return the selected topics' connection IDs."""
    return [
        connection.id
        for connection in reader.connections.values()
        if not selection.topics or connection.topic in selection.topics
    ]


def _numbered(number: int, reader: BagReader, selection: Selection) -> Iterator[tuple[int, StoredMessage]]:
    wanted = _wanted(reader, selection)
    if not wanted:
        return
    for message in reader.messages(wanted, selection.start, selection.end):
        yield number, message


def _time(item: tuple[int, StoredMessage]) -> int:
    return item[1].time
