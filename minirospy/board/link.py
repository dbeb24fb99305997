"""A process's connection to a board: sends operations, mirrors the pins, and reports edges.

Blocking and thread-safe; one reader thread updates the mirror. If no server responds, the link starts one; if the server
dies, the link starts another one, and unacknowledged requests are sent again, so that the caller sees no error.
"""

from __future__ import annotations

import contextlib
import os
import socket
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from minirospy.base import private_files
from minirospy.base.child_lifetime import start_outside_of_job
from minirospy.base.errors import BoardError
from minirospy.board.directory import BoardDirectory
from minirospy.board.model import Function, Operation, Pin, Position, Setup, Write
from minirospy.board.protocol import (
    VERSION,
    Changed,
    Done,
    Hello,
    Message,
    MovePerson,
    PersonMoved,
    ProtocolError,
    Refused,
    Request,
    Stream,
    Welcome,
    serialize,
)

if TYPE_CHECKING:
    import subprocess

__all__ = ["Edge", "Link"]

START_PATIENCE = 30.0
"""Seconds to wait for a server to start. A small machine under load needs two or three, one with blocked I/O up to fifteen."""

ANSWER_PATIENCE = 40.0  # seconds to wait for a response; longer than it takes to replace a dead server

CLOSE_PATIENCE = 0.5  # seconds for which close() waits for the last outputs to arrive

# maximum number of requests in progress; above it, an output waits for the server
MAX_UNACKNOWLEDGED = 10_000

_SERVE = """\
import sys
sys.path.append(sys.argv[1])
from minirospy.board.server import main
sys.exit(main(sys.argv[2:]))
"""
"""Does the same as `python -m minirospy.board.server`, but also works if the package was imported from the current folder."""


class Edge(NamedTuple):
    """Pin ``pin`` (BCM) changed to ``level`` at ``time``, in Unix seconds."""

    pin: int
    level: int
    time: float


class Link:
    """A connection to a board.

    ``levels`` mirrors every pin's level. It is always the same list, and the fastest way to read a pin.
    ``on_edge`` is called in the reader thread, for every edge on the board.

    Raise BoardError if no server can be started.
    """

    def __init__(self, directory: BoardDirectory, on_edge: Callable[[Edge], None] | None = None) -> None:
        self._directory = directory
        self._on_edge = on_edge
        # Use a reentrant lock: a signal handler, such as a node's shutdown hook, may set pins while its thread holds the lock.
        self._lock = threading.RLock()
        self._news = threading.Condition(self._lock)
        self._number = 0
        self._acknowledged = 0
        self._unacknowledged: deque[tuple[int, bytes]] = deque()
        self._written: dict[int, int] = {}
        self._refused: dict[int, str] = {}
        self._mine: set[int] = set()
        self._failure: BoardError | None = None
        self._closed = False
        self._connection: _Connection | None = _reach(directory, lambda: False)
        self.states: list[Pin] = list(self._connection.pins)
        self.levels: list[int] = [pin.level for pin in self.states]
        self.person = self._connection.person
        self._reader = threading.Thread(target=self._read, name="gpio-mirror", daemon=True)
        self._reader.start()

    def call(self, operation: Operation | MovePerson | None, timeout: float = ANSWER_PATIENCE) -> None:
        """Perform ``operation``; return when its effect has arrived in the mirror, this process's copy of the pins.

        If it is None, only wait for the operations sent earlier. Raise BoardError if the board refuses, or does not
        respond within ``timeout`` seconds.
        """
        with self._lock:
            number = self._send(operation)
            if isinstance(operation, Setup):
                self._mine.add(operation.pin)
            answered = self._news.wait_for(lambda: self._acknowledged >= number or self._failure, timeout)
            if self._failure is not None:
                raise self._failure
            if number in self._refused:
                raise BoardError(self._refused.pop(number))
            if not answered:
                raise BoardError(f"the virtual board [{self._directory.name}] does not answer")

    def write(self, levels: Sequence[tuple[int, int]]) -> None:
        """Set output pins' latches, in order, usually without waiting; :attr:`levels` shows them immediately."""
        with self._lock:
            if len(self._unacknowledged) >= MAX_UNACKNOWLEDGED:
                self.call(None)
            number = self._send(Write(levels))
            for pin, level in levels:
                if self.states[pin].function is Function.OUT:
                    self.levels[pin] = level
                    self._written[pin] = number

    def close(self) -> None:
        """Wait briefly for the last outputs, then disconnect. The pins do not change."""
        if self._closed:
            return
        with contextlib.suppress(BoardError):
            self.call(None, CLOSE_PATIENCE)
        with self._lock:
            self._closed = True
            if self._connection is not None:
                self._connection.hang_up()
        if threading.current_thread() is not self._reader:
            self._reader.join(CLOSE_PATIENCE)

    def _send(self, operation: Operation | MovePerson | None) -> int:
        if self._closed:
            raise BoardError(f"the connection to the virtual board [{self._directory.name}] is closed")
        if self._failure is not None:
            raise self._failure
        self._number += 1
        data = serialize(Request(self._number, operation))
        self._unacknowledged.append((self._number, data))
        if self._connection is not None:
            self._connection.send(data)
        return self._number

    def _read(self) -> None:
        connection = self._connection
        while connection is not None:
            for messages in connection.incoming():
                with self._lock:
                    edges = [edge for message in messages if (edge := self._take(message))]
                    self._news.notify_all()
                self._report(edges)
            connection.hang_up()
            connection = self._reconnect()

    def _reconnect(self) -> _Connection | None:
        with self._lock:
            self._connection = None
        if self._closed:
            return None

        try:
            connection = _reach(self._directory, lambda: self._closed)
        except BoardError as error:
            with self._lock:
                self._failure = error
                self._news.notify_all()
            return None

        with self._lock:
            if self._closed:
                connection.hang_up()
                return None
            now = time.time()
            edges = []
            # The old server may have been killed before it saved the last changes.
            # Repeat the setup of this process's pins, with the last latches that the old server reported.
            for pin in sorted(self._mine):
                state = self.states[pin]
                latch = state.latch if state.function is Function.OUT else None
                connection.send(serialize(Request(0, Setup(pin, state.function, state.pull, latch))))
            for pin, state in enumerate(connection.pins):
                if pin not in self._mine:
                    edge = self._take(Changed(pin, state, state.level != self.states[pin].level, now))
                    edges += [edge] if edge else []
            self.person = connection.person
            for _number, data in self._unacknowledged:
                connection.send(data)
            self._connection = connection

        self._report(edges)
        return connection

    def _take(self, message: Message) -> Edge | None:
        """Apply one message to this process's copy of the pins; return the edge that it reports, if any. Hold the lock."""
        if isinstance(message, Changed):
            self.states[message.pin] = message.state
            level = message.state.level
            # Skip a change that was sent before this process's latest write: it would undo that write for a moment.
            if message.pin not in self._written:
                self.levels[message.pin] = level
            return Edge(message.pin, level, message.time) if message.edge else None
        if isinstance(message, PersonMoved):
            self.person = message.position
        elif isinstance(message, Refused):
            self._refused[message.number] = message.why
            self._acknowledge(message.number)
        elif isinstance(message, Done):
            self._acknowledge(message.number)
        return None

    def _acknowledge(self, number: int) -> None:
        self._acknowledged = max(self._acknowledged, number)
        while self._unacknowledged and self._unacknowledged[0][0] <= number:
            self._unacknowledged.popleft()
        for pin in [pin for pin, written in self._written.items() if written <= number]:
            del self._written[pin]
            self.levels[pin] = self.states[pin].level

    def _report(self, edges: list[Edge]) -> None:
        if self._on_edge is not None:
            for edge in edges:
                self._on_edge(edge)


class _Connection:
    """A connection on which the server has sent its Welcome, with the ``pins`` and the ``person``."""

    def __init__(self, link: socket.socket, stream: Stream, welcome: Welcome, more: list[Message]) -> None:
        self._socket = link
        self._stream = stream
        self._more = more
        self.pins: list[Pin] = welcome.pins
        self.person: Position | None = welcome.person

    def send(self, data: bytes) -> None:
        # Ignore errors, because the reader detects a dead server and replaces it.
        with contextlib.suppress(OSError):
            self._socket.sendall(data)

    def incoming(self) -> Iterator[list[Message]]:
        """Yield batches of messages as they arrive, until the connection is closed."""
        if self._more:
            yield self._more
        with contextlib.suppress(OSError, ProtocolError):
            while data := self._socket.recv(65536):
                yield list(self._stream.feed(data))

    def hang_up(self) -> None:
        # Call shutdown first, which, unlike close, wakes the reader.
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)
        self._socket.close()


def _reach(directory: BoardDirectory, given_up: Callable[[], bool]) -> _Connection:
    """Connect to the board's server. Start one if none responds."""
    directory.prepare()
    deadline = time.monotonic() + START_PATIENCE
    process: subprocess.Popen[bytes] | None = None
    pause = 0.004
    while True:
        connection = _connect(directory)
        if connection is not None:
            return connection
        status = None if process is None else process.poll()
        if (status or 0) > 0 or given_up() or time.monotonic() > deadline:
            raise BoardError(f"the virtual board [{directory.name}] does not start{_last_words(directory)}")
        if process is None or status is not None:
            # Status 0 without a responding server: the new server exited because of another server, which has exited since.
            # Negative status: a Ctrl-C for this process killed the new server before it had detached from the terminal.
            process = _start_server(directory)
        time.sleep(pause)
        pause = min(pause * 1.3, 0.05)


def _connect(directory: BoardDirectory) -> _Connection | None:
    """Connect, and exchange Hello and Welcome. Return the connection, or None if no server responds."""
    token = ""

    try:
        if sys.platform != "win32" and directory.uses_unix_socket:
            link = socket.socket(socket.AF_UNIX)
            target: str | tuple[str, int] = str(directory.socket_path)
        else:
            port, token = directory.address_path.read_text().split()
            link = socket.socket(socket.AF_INET)
            link.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            target = ("127.0.0.1", int(port))
    except (OSError, ValueError):
        return None

    try:
        link.settimeout(5.0)
        link.connect(target)
        link.sendall(serialize(Hello(VERSION, token)))
        stream = Stream()
        messages: list[Message] = []
        while not messages:
            data = link.recv(65536)
            if not data:
                raise ConnectionResetError
            messages += stream.feed(data)
        link.settimeout(None)
    except (OSError, ProtocolError):
        link.close()
        return None

    welcome, *more = messages
    if not isinstance(welcome, Welcome) or welcome.version != VERSION:
        link.close()
        raise BoardError(f"the virtual board [{directory.name}] is in use by another version of minirospy")

    return _Connection(link, stream, welcome, more)


def _start_server(directory: BoardDirectory) -> subprocess.Popen[bytes]:
    """Start and return a server process in a new session. The server outlives this process if the board still has clients."""
    import subprocess

    if not sys.executable:
        raise BoardError("the virtual board cannot be started: sys.executable is not set")
    root = str(Path(__file__).resolve().parents[2])
    flags = 0
    windows = sys.platform == "win32"
    if sys.platform == "win32":
        flags = subprocess.CREATE_NO_WINDOW | subprocess.CREATE_NEW_PROCESS_GROUP
    # A temporary board's server may end with this process, because it only serves processes started here.
    start = subprocess.Popen if os.environ.get("MINIROSPY_BOARD_TEMPORARY") else start_outside_of_job
    with open(os.devnull, "a") if windows else private_files.open_text(directory.log_path, "a") as log:
        process = start(
            [sys.executable, "-c", _SERVE, root, str(directory.folder), directory.name],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            # On Windows the server writes the log itself; see server.py for the reason.
            stderr=log,
            cwd=directory.folder,
            start_new_session=True,
            creationflags=flags,
        )
    # Wait for the server's exit status; otherwise it would remain as a zombie of a long-lived client.
    threading.Thread(target=process.wait, name="gpio-server-wait", daemon=True).start()
    return process


def _last_words(directory: BoardDirectory) -> str:
    try:
        lines = directory.log_path.read_text(errors="replace").strip().splitlines()
    except OSError:
        return ""
    return f": {lines[-1]} ({directory.log_path})" if lines else ""
