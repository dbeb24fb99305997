"""An XML-RPC server on the event loop.

Its connections are plain sockets that the loop watches, because a master serves thousands of short connections, and an
asyncio transport for each would cost more than everything else together.

No client delays the others: a short request is processed immediately. A long one (a large body, a large response, many
calls in one) is processed in steps, for a few milliseconds in each loop iteration (``runtime/rpc/turns.py``). Memory
is limited for all clients together, both for incomplete requests and for unread responses.
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
import logging
import socket
import time
from collections import OrderedDict
from collections.abc import Callable, Iterable
from itertools import islice

from minirospy.runtime.rpc.connection import Connection
from minirospy.runtime.rpc.turns import Turns
from minirospy.runtime.transport import local, sockets, tcp
from minirospy.runtime.transport.access import Access
from minirospy.runtime.transport.deadlines import Deadlines
from minirospy.runtime.transport.limits import explain
from minirospy.runtime.transport.rate_limited_logger import RateLimitedLogger

__all__ = ["Dispatch", "RpcServer", "is_address_in_use"]

_log = logging.getLogger(__name__)

# Maximum total bytes of all clients' requests that are incomplete or being read; above it, the largest are refused
MAX_HELD = 72 * 1024 * 1024
LARGE_REQUEST = 32 * 1024  # a request of at most this many bytes is never refused because of MAX_HELD

# Maximum bytes of unread responses to all clients together.
# Above it, disconnect the client that has gone longest without reading.
_MAX_UNREAD_OF_ALL = 72 * 1024 * 1024

_BACKLOG = 4096
"""Maximum number of connections that the kernel queues.

If the queue is full, the kernel drops a client's first segments. The client resends them after growing delays: 1, 3, 7 s
while connecting, then up to 25 s for its request.
"""

_ACCEPTS_AT_ONCE, _ACCEPT_SECONDS = 1024, 0.015
_READ_SECONDS = 0.003
"""Seconds per loop iteration for reading from connections that were just accepted. The line above sets the limits for
accepting: the number of connections, and the seconds per iteration.

Thousands of clients may connect together; the server accepts all of them, 30 us each, before it serves a later one.
"""

_ACCEPTS_BETWEEN = 64  # maximum number of connections to accept between reads

# Number of connections to read before accepting new ones, about 1 ms of work; thousands may be readable together
_READS_AT_ONCE = 16

# Maximum connections to read per loop iteration, and maximum seconds for it; the next iteration reads the rest first
_MAX_READS, _READS_SECONDS = 256, 0.01


Dispatch = Callable[[str, list[object]], object]
"""A function that is called with a method name and arguments.

Returns the value, an awaitable of it, or steps that compute it; may raise RpcFault.
"""


class RpcServer:
    """Serves ``dispatch`` over HTTP on any path, with keep-alive and pipelining."""

    def __init__(
        self,
        dispatch: Dispatch,
        *,
        bind_host: str = "127.0.0.1",
        port: int = 0,
        ports: range | None = None,
        max_idle: int | None = None,
        access: Access | None = None,
        known_as: Iterable[str] = (),
    ) -> None:
        """Create a server on ``port``; port 0 means any free port, chosen from ``ports`` if given.

        ``known_as``: host names by which processes on this machine may connect through a Unix socket.

        The ``max_idle`` most recently active clients stay connected (None: all). Clients that ``access`` does not allow are
        disconnected.
        """
        self.dispatch = dispatch
        self.port = port
        self.refused = 0  # number of connections refused by ``access``
        self.held = 0  # total bytes of requests that are incomplete or are being read
        self.holders: dict[Connection, int] = {}  # dict from connection to its share of ``held``, in bytes
        self.unread = 0  # total bytes of responses that clients have not read yet
        self.slow: OrderedDict[Connection, None] = OrderedDict()
        """The connections with unread responses, least recently read first."""
        self.turns = Turns()
        self.connections: OrderedDict[Connection, None] = OrderedDict()
        """All connections, least recently active first."""

        self._bind_host = bind_host
        self._ports = ports
        self._most = max_idle
        # If only a few clients may stay connected, read from each before accepting the next:
        # clients that are accepted together may displace each other.
        self._reads_all = max_idle is not None and max_idle <= _ACCEPTS_AT_ONCE
        self._access = access
        self._known_as = dict.fromkeys(known_as)
        self._sock: socket.socket | None = None
        self._listening: list[socket.socket] = []
        # Sockets on which accepting is briefly paused.
        self._resting: set[socket.socket] = set()
        # Number of connections read in this loop iteration, the deadline for reading, and whether the deadline has passed.
        self._reads = 0
        self._reads_end = 0.0
        self._reads_over = False
        # Connections to read in the next iteration: new ones, and those that have already made a request.
        self._late_new: OrderedDict[Connection, None] = OrderedDict()
        self._late: OrderedDict[Connection, None] = OrderedDict()

        self.deadlines: Deadlines[Connection] = Deadlines(Connection.end)
        """Time limits for receiving a request or sending a response; idle connections have none."""
        self._limited_log = RateLimitedLogger(_log)
        self._strangers = RateLimitedLogger(_log, 10)
        self._unaccepted = RateLimitedLogger(_log)

    @property
    def clients(self) -> int:
        """Return the number of connected clients."""
        return len(self.connections)

    def listen(self) -> None:
        """Bind the port exclusively; clients that connect are queued until :meth:`start`. Idempotent.

        With port 0, ``port`` is set to the chosen port. Raise OSError if the port cannot be bound.
        """
        if self._sock is not None:
            return
        sock = tcp.bind(self._bind_host, self.port, self._ports)
        try:
            # Accepted sockets inherit this option from the listening one.
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            # Listen here, because two sockets may be bound to the same port as long as neither listens.
            sock.listen(_BACKLOG)
        except BaseException:
            sock.close()
            raise
        self.port = sock.getsockname()[1]
        self._sock = sock

    async def start(self) -> None:
        """Serve clients; calls :meth:`listen` first if necessary. Raise OSError if the port cannot be bound."""
        self.listen()
        assert self._sock
        self._watch(self._sock)
        for host in self._known_as:
            unix = local.bind(host, self.port)
            if unix:
                unix.listen(_BACKLOG)
                self._watch(unix)

    async def close(self) -> None:
        """Stop listening and close all connections. Idempotent."""
        while self._listening:
            sock = self._listening.pop()
            asyncio.get_running_loop().remove_reader(sock)
            sock.close()
        if self._sock is not None:
            self._sock.close()
        for connection in list(self.connections):
            connection.end()
        self.turns.close()
        self.deadlines.close()
        self._limited_log.close()
        self._strangers.close()
        self._unaccepted.close()

    def _watch(self, sock: socket.socket) -> None:
        self._listening.append(sock)
        asyncio.get_running_loop().add_reader(sock, self._accept, sock)

    def admit(self, connection: Connection, *, is_new: bool) -> bool:
        """Return whether a readable connection should be read now. If not, it is read in the next iteration.

        ``is_new``: the connection has made no request yet.
        """
        if self._may_read():
            return True
        (self._late_new if is_new else self._late).setdefault(connection)
        return False

    def drop_late(self, connection: Connection) -> None:
        """Cancel the read of a connection, if one is scheduled for the next iteration. Idempotent."""
        self._late_new.pop(connection, None)
        self._late.pop(connection, None)

    def _may_read(self) -> bool:
        """Return whether another connection may be read in this loop iteration.

        Occasionally, accept new connections first.
        """
        if self._reads_over:
            return False
        self._reads += 1
        if self._reads % _READS_AT_ONCE:
            return True

        if self._reads == _READS_AT_ONCE:
            self._reads_end = time.perf_counter() + _READS_SECONDS
            asyncio.get_running_loop().call_soon(self._start_iteration)
        for sock in list(self._listening):
            if sock not in self._resting:
                self._accept(sock, _ACCEPTS_BETWEEN)
        self._reads_over = self._reads >= _MAX_READS or time.perf_counter() >= self._reads_end
        return not self._reads_over

    def _start_iteration(self) -> None:
        """Read the connections left over from the last iteration before the loop handles any others."""
        self._reads, self._reads_over = 0, False
        number = 0
        while (self._late_new or self._late) and self._may_read():
            # Alternate between new connections and those that have already made a request, so that many of one kind do not
            # delay the other kind.
            if self._late_new and (number % 3 or not self._late):
                connection, _ = self._late_new.popitem(last=number % 2 == 0)
            else:
                connection, _ = self._late.popitem(last=False)
            number += 1
            connection.read()

    def _watch_again(self, sock: socket.socket) -> None:
        self._resting.discard(sock)
        if sock in self._listening:
            asyncio.get_running_loop().add_reader(sock, self._accept, sock)

    def _accept(self, sock: socket.socket, most: int = _ACCEPTS_AT_ONCE) -> None:
        loop = asyncio.get_running_loop()
        start = now = time.perf_counter()

        for _ in range(most):
            if now - start >= _ACCEPT_SECONDS:
                return
            try:
                peer, address = sock.accept()
            except (BlockingIOError, InterruptedError, ConnectionAbortedError):
                return
            except OSError as error:
                # No file descriptors are free: close the connection that has been silent longest, and retry a moment later.
                self._unaccepted.error("a connection could not be accepted: %s", explain(error))
                self._end_longest_silent()
                loop.remove_reader(sock)
                self._resting.add(sock)
                loop.call_later(0.05, self._watch_again, sock)
                return
            if peer.family not in sockets.FAMILIES or self._allows(peer, address[0]):
                self._serve(peer, loop, reads=self._reads_all or now - start < _READ_SECONDS)
            else:
                peer.close()
            now = time.perf_counter()

    def _serve(self, peer: socket.socket, loop: asyncio.AbstractEventLoop, *, reads: bool) -> None:
        try:
            peer.setblocking(False)
        except OSError:
            # The peer has already disconnected.
            peer.close()
            return
        if self._most is not None and len(self.connections) >= self._most:
            self._end_longest_silent()
        connection = Connection(self, peer, loop)
        self.connections[connection] = None
        if reads:
            # Read immediately, because the first request has usually arrived by now.
            connection.read()

    def log_refusal(self, sock: socket.socket, why: str) -> None:
        """Log a refused request, with a rate limit."""
        try:
            # A peer that is connected by a Unix socket has no address.
            name = sock.getpeername()[0] if sock.family in sockets.FAMILIES else "this machine"
        except OSError:
            name = "a client"
        self._limited_log.warning("a request from %s was refused: %s", name, why)

    def limit_held(self, connection: Connection) -> bool:
        """Refuse the largest requests if the total exceeds the limit; return whether ``connection`` was not refused."""
        while self.held > MAX_HELD:
            largest = max(self.holders, key=self.holders.__getitem__)
            if self.holders[largest] <= LARGE_REQUEST:
                break
            largest.refuse(503, "too much is being sent at the same time: try again later")
        return not connection.is_refused

    def limit_unread(self) -> None:
        """Disconnect the slowest clients if the total of unread responses exceeds the limit."""
        while self.unread > _MAX_UNREAD_OF_ALL and len(self.slow) > 1:
            slowest = next(iter(self.slow))
            slowest.log_refusal("its answers were not read")
            slowest.end()

    def _end_longest_silent(self) -> None:
        """Close the connection that has been silent longest; prefer one with no call in progress."""
        longest_silent = list(islice(self.connections, 20))
        if longest_silent:
            next((each for each in longest_silent if each.is_idle), longest_silent[0]).end()

    def _allows(self, peer: socket.socket, address: str) -> bool:
        if self._access is None or not self._access.networks:
            return True
        with contextlib.suppress(OSError):
            if self._access.allows(address, peer.getsockname()[0]):
                return True
        self.refused += 1
        self._strangers.warning(
            "a connection from %s was refused: only %s may connect", address, self._access
        )
        return False


def is_address_in_use(error: OSError) -> bool:
    """Return whether listening failed because another process listens on the port."""
    return error.errno == errno.EADDRINUSE or getattr(error, "winerror", None) == 10048
