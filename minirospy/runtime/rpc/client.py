"""A blocking XML-RPC client. It works in the caller's thread and does not import asyncio."""

from __future__ import annotations

import contextlib
import socket
from collections import deque
from typing import Any

from minirospy.base.environment import split_uri
from minirospy.base.errors import RpcProtocolError, RpcTimeout, RpcUnreachable
from minirospy.core.wire.http import HttpMessage, HttpReader, serialize_request
from minirospy.core.wire.xmlrpc import parse_response, serialize_call
from minirospy.runtime.transport import local, sockets
from minirospy.runtime.transport.limits import explain, is_file_limit

__all__ = ["RpcClient", "parse_http_uri"]

_RECEIVE = 65536

# Seconds; the kernel accepts connections even for a busy program, so a slower server counts as unreachable
_CONNECT_SECONDS = 5.0


class RpcClient:
    """Calls methods on one server. Thread-safe; connections stay open and are reused.

    A call removes a connection from the pool while it runs, so a signal handler that makes a call during another call in
    the same thread uses a separate connection.
    """

    def __init__(self, uri: str, timeout: float = 5.0, *, same_host: bool = True) -> None:
        """Create the client for ``uri``. ``timeout``, in seconds, limits connecting (to 5 s at most) and each wait for data.

        ``same_host``: try a Unix socket first.

        Raise RpcUnreachable if the URI is invalid.
        """
        self.uri = uri
        self._host, self._port, self._path = parse_http_uri(uri)
        self.timeout = timeout
        self._same_host = same_host
        self.idle: deque[socket.socket] = deque()

    def call(self, method: str, *args: object) -> Any:
        """Call ``method`` and return the value in the response.

        Raise RpcUnreachable if the server does not respond, RpcFault if the call fails there, RpcProtocolError if the
        response is invalid or an argument has no XML-RPC type.
        """
        request = serialize_request(f"{self._host}:{self._port}", self._path, serialize_call(method, args))
        message = self._exchange(request)
        if message.status != 200:
            raise RpcProtocolError(f"{self.uri} answered {message.start}")
        return parse_response(message.body)

    def close(self) -> None:
        """Close the idle connections. Idempotent."""
        while self.idle:
            self.idle.pop().close()

    def _exchange(self, request: bytes) -> HttpMessage:
        try:
            sock: socket.socket | None = self.idle.pop()
        except IndexError:
            sock = None
        try:
            if sock is not None:
                # The peer may have closed an idle connection in the meantime, so retry on a new one.
                with contextlib.suppress(ConnectionError, EOFError):
                    return self._ask(sock, request)
            return self._ask(self._connect(), request)
        except TimeoutError as error:
            raise RpcTimeout(self.uri, self.timeout) from error
        except (OSError, EOFError) as error:
            why = explain(error) if is_file_limit(error) else getattr(error, "strerror", None) or str(error)
            why = why or "the connection was closed"
            raise RpcUnreachable(self.uri, why) from error

    def _connect(self) -> socket.socket:
        unix = local.reach(self._host, self._port) if self._same_host else None
        if unix:
            unix.settimeout(self.timeout)
            return unix
        seconds = min(self.timeout, _CONNECT_SECONDS)
        try:
            # "localhost" may resolve to an IPv6 address first, on which a ROS 1 server listens only with ROS_IPV6.
            host: Any = sockets.resolvable("127.0.0.1" if self._host == "localhost" else self._host)
            sock = socket.create_connection((host, self._port), seconds)
        except ConnectionRefusedError:
            if self._host != "localhost" or not socket.has_ipv6:
                raise
            sock = socket.create_connection(("::1", self._port), seconds)
        except TimeoutError as error:
            raise self._late(seconds) from error
        sock.settimeout(self.timeout)
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return sock

    def _late(self, seconds: float) -> RpcUnreachable:
        return RpcUnreachable(self.uri, f"timed out after {seconds:g} s")

    def _ask(self, sock: socket.socket, request: bytes) -> HttpMessage:
        reader = HttpReader()
        try:
            sock.sendall(request)
            sockets.busy_poll(sock)
            while True:
                data = sock.recv(_RECEIVE)
                if not data and reader.is_idle:
                    raise EOFError("the connection was closed without an answer")
                messages = reader.feed(data)
                if messages:
                    break
        except BaseException:
            sock.close()
            raise

        if messages[0].keep_alive:
            self.idle.append(sock)
        else:
            sock.close()
        return messages[0]


def parse_http_uri(uri: str) -> tuple[str, int, str]:
    """Parse ``http://host:port/path`` into (host, port, path). Raise RpcUnreachable if the URI is invalid."""
    try:
        return split_uri(uri)
    except ValueError as error:
        raise RpcUnreachable(uri, "not a URI of the form http://host:port") from error
