"""A listening socket and its connections, with a limit on their number."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import logging
import socket
import ssl
import time
from collections.abc import Callable, Mapping, Sequence
from urllib.parse import unquote, urlsplit

from minirospy.base.errors import BridgeError
from minirospy.runtime.transport import tcp
from minirospy.runtime.transport.limits import is_file_limit
from minirospy.web.access import Access, Credentials, Grant, Refusal
from minirospy.web.server.account import Account
from minirospy.web.server.admission import Rank, displaced, rank_of
from minirospy.web.server.client import PLAIN_HEADERS, Endpoint, HttpHandler, Limits, response_head
from minirospy.web.server.connection import Connection
from minirospy.web.server.owners import is_own_user
from minirospy.web.server.pipe import PipeEvents, PlainPipe, TlsPipe
from minirospy.web.server.rate import ConnectionRate
from minirospy.web.server.turns import FairTurns, cpu_meter

__all__ = ["Listener", "Relay"]

_log = logging.getLogger(__name__)

_ACCEPTS_A_TURN = 50
_REQUEST = 64 * 1024


def _refusal(status: int, retry_after: int, text: str) -> bytes:
    headers = {
        **PLAIN_HEADERS,
        "Content-Type": "text/plain; charset=utf-8",
        "Retry-After": str(retry_after),
        "Content-Length": str(len(text) + 1),
    }
    return response_head(status, headers) + f"{text}\n".encode()


_TOO_MANY = _refusal(503, 5, "too many connections.")
_TOO_OFTEN = _refusal(429, 1, "too many new connections from this address: wait a second")


class Listener:
    """Serves pages (HTTP), and endpoints (protocols over WebSocket), on one port."""

    def __init__(
        self,
        endpoints: Sequence[Endpoint],
        access: Access,
        *,
        limits: Limits | None = None,
        pages: Mapping[str, HttpHandler] | None = None,
        public_pages: Mapping[str, HttpHandler] | None = None,
        tls: ssl.SSLContext | None = None,
        account: Account | None = None,
        on_change: Callable[[int], object] = lambda _: None,
        warn: Callable[[str], object] = lambda _: None,
    ) -> None:
        """Create the listener. ``pages`` maps paths to handlers; ``public_pages`` need no token.

        ``on_change`` is called with the number of connections, ``warn`` with a refusal that names an option for the owner.
        """
        self.endpoints = endpoints
        self.limits = limits or Limits()
        self.connections: set[Connection] = set()
        self.refused = 0
        """Number of connections refused because there were too many connections, or too many new ones."""
        self.rate = ConnectionRate(
            self.limits.connections_a_second, self.limits.connection_burst, time.monotonic
        )
        self.turns = FairTurns(_call_soon, time.monotonic, meter=cpu_meter())
        self.account = account or Account(self.limits.memory)
        """The memory of all clients, including those of the server's other listeners."""

        self.host = ""
        self.port = 0
        self._access = access
        self._public_pages = dict(public_pages or {})
        self._pages = {**(pages or {}), **self._public_pages}
        self._tls = tls
        self._on_change = on_change
        self._warn = warn
        self._socks: list[socket.socket] = []
        self._server: asyncio.Server | None = None

    @property
    def is_encrypted(self) -> bool:
        """Return whether clients connect with wss and https."""
        return self._tls is not None

    async def open(self, host: str, port: int) -> None:
        """Start listening; port 0 means any free port. Raise BridgeError if the port cannot be opened."""
        loop = asyncio.get_running_loop()
        try:
            sock = tcp.bind(host, port)
        except OSError as error:
            hint = (
                " (another bridge may be running: give another port)"
                if error.errno == errno.EADDRINUSE
                else ""
            )
            raise BridgeError(f"cannot listen at {host}:{port}: {error.strerror or error}{hint}") from error

        sock.setblocking(False)
        sock.listen(128)
        self.host, self.port = host, sock.getsockname()[1]
        if self._tls:
            self._server = await loop.create_server(
                lambda: TlsPipe(self._connected_tls),
                sock=sock,
                ssl=self._tls,
                ssl_handshake_timeout=self.limits.handshake_seconds,
            )
        else:
            self._socks.append(sock)
            loop.add_reader(sock, self._accept, sock)

    async def close(self) -> None:
        """Stop listening, and close all connections. Idempotent."""
        loop = asyncio.get_running_loop()
        for sock in self._socks:
            loop.remove_reader(sock)
            sock.close()
        self._socks.clear()
        server, self._server = self._server, None
        if server:
            server.close()
        for connection in list(self.connections):
            connection.close_websocket(1001, "the bridge is shut down")
        for _ in range(10):
            if not self.connections:
                return
            await asyncio.sleep(0.02)
        for connection in list(self.connections):
            connection.abort()

    # --- Site

    def check(self, credentials: Credentials, *, is_page: bool) -> Grant | Refusal:
        """Return the rights of the sender of a request, or the reason for refusing it."""
        found: Grant | Refusal
        if is_page and unquote(urlsplit(credentials.target).path) in self._public_pages:
            found = self._access.check_host(credentials.host) or Grant.READ
        else:
            found = self._access.check(credentials)
        if isinstance(found, Refusal) and found.names_option:
            self._warn(found.text)
        return found

    def page(self, path: str) -> HttpHandler | None:
        """Return the handler for a path, or None if there is none."""
        return self._pages.get(path)

    def admit(self, connection: Connection, grant: Grant) -> Refusal | None:
        """Admit a connection that has sent its request, or return the reason for refusing it."""
        rank = rank_of(grant)
        served = [each for each in self._open() if each.rank > Rank.SILENT]
        if len(served) >= self.limits.connections:
            if self._is_own(connection):
                rank = Rank.OWN
            if not self._make_room(connection.peer, rank, served):
                self.refused += 1
                return Refusal(503, "too many connections.")
        connection.rank = rank
        return None

    def left(self, connection: Connection) -> None:
        """Remove a connection that has closed."""
        self.connections.discard(connection)
        self._on_change(len(self.connections))

    # --- internals

    def _accept(self, listening: socket.socket) -> None:
        for _ in range(_ACCEPTS_A_TURN):
            try:
                sock, address = listening.accept()
            except (BlockingIOError, InterruptedError, ConnectionAbortedError):
                return
            except OSError as error:
                if is_file_limit(error):
                    _log.error("no connection: %s", error)
                    self._rest(listening)
                return

            sock.setblocking(False)
            refusal = self._refusal_of((str(address[0]), address[1]), sock.getsockname()[:2])
            if refusal:
                _refuse(sock, refusal)
                continue
            with contextlib.suppress(OSError):
                sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._connected(sock, str(address[0]))

    def _rest(self, listening: socket.socket) -> None:
        """Stop accepting connections for one second, because the loop would spin while the listening socket stays readable."""
        loop = asyncio.get_running_loop()
        loop.remove_reader(listening)

        def resume() -> None:
            if listening in self._socks:
                loop.add_reader(listening, self._accept, listening)

        loop.call_later(1.0, resume)

    def _connected(self, sock: socket.socket, peer: str) -> None:
        loop = asyncio.get_running_loop()
        relay = Relay()
        pipe = PlainPipe(sock, loop, relay)
        relay.target = self._add(Connection(self, pipe, peer, loop))
        pipe.resume()

    def _connected_tls(self, pipe: TlsPipe, peer: str) -> PipeEvents | None:
        peer_port, address, port = pipe.endpoints
        refusal = self._refusal_of((peer, peer_port), (address, port))
        if refusal:
            pipe.write((refusal,))
            return None
        return self._add(Connection(self, pipe, peer, asyncio.get_running_loop()))

    def _refusal_of(self, peer: tuple[str, int], here: tuple[str, int]) -> bytes | None:
        """Return the response that refuses a client, or None if it may connect now.

        This user's clients may connect at any rate, and displace other clients if there are too many connections.
        """
        limits = self.limits
        is_full = len(self.connections) >= limits.connections + limits.reserve
        is_too_often = not self.rate.admits(peer[0])
        if not (is_full or is_too_often):
            return None
        is_own = is_own_user(peer, here)
        if is_too_often and not is_own:
            refusal = _TOO_OFTEN
        elif not is_full or self._make_room(peer[0], Rank.OWN if is_own else Rank.SILENT, self._open()):
            return None
        else:
            refusal = _TOO_MANY
        self.refused += 1
        return refusal

    def _make_room(self, peer: str, rank: Rank, occupants: Sequence[Connection]) -> bool:
        """Disconnect one of ``occupants`` to admit a new connection from ``peer``, if the rules allow it.

        Return whether one was found.
        """
        now = asyncio.get_running_loop().time()
        while found := displaced(peer, rank, occupants, now):
            if Rank.SILENT < found.rank < Rank.OWN and self._is_own(found):
                found.rank = Rank.OWN  # determine this only here: it is slow, and rarely needed
                continue
            _log.info("%s gives way to %s", found.peer, peer)
            found.give_way()
            return True
        return False

    def _is_own(self, connection: Connection) -> bool:
        """Return whether a client is known to be a program of the server's user."""
        peer_port, address, port = connection.endpoints
        return is_own_user((connection.peer, peer_port), (address, port))

    def _open(self) -> list[Connection]:
        return [each for each in self.connections if each.is_open]

    def _add(self, connection: Connection) -> Connection:
        self.connections.add(connection)
        self._on_change(len(self.connections))
        return connection


def _call_soon(work: Callable[[], None]) -> None:
    asyncio.get_running_loop().call_soon(work)


def _refuse(sock: socket.socket, answer: bytes) -> None:
    with contextlib.suppress(OSError):
        sock.send(answer)
        sock.shutdown(socket.SHUT_WR)
    with contextlib.suppress(OSError):
        # Read first: closing a socket with unread data resets the connection, which may lose the response.
        sock.recv(_REQUEST)
    sock.close()


class Relay:
    """Forwards the events of a pipe to its connection, which is created later."""

    target: Connection

    def received(self, data: bytes) -> None:
        """Forward received bytes."""
        self.target.received(data)

    def writable(self) -> None:
        """Notify the connection that it can write more."""
        self.target.writable()

    def ended(self) -> None:
        """Notify the connection that the pipe has closed."""
        self.target.ended()
