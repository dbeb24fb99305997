"""rosmaster.util: XML-RPC server proxies, one per thread and URI."""

from __future__ import annotations

import errno
import socket
import threading
from typing import Any
from urllib.parse import urlparse
from xmlrpc.client import ServerProxy

__all__ = [
    "close_half_closed_sockets",
    "remove_server_proxy",
    "xmlrpcapi",
]

_CLOSE_WAIT = 8  # Linux's TCP state CLOSE_WAIT: the peer has closed the connection


class _Proxies(threading.local):
    def __init__(self) -> None:
        self.by_uri: dict[str, ServerProxy] = {}


_PROXIES = _Proxies()


def xmlrpcapi(uri: str | None) -> ServerProxy | None:
    """Return the proxy for a URI, or None if the URI has no host. Raise OSError if it is not an http URI."""
    if uri is None or not urlparse(uri).netloc:
        return None
    if uri not in _PROXIES.by_uri:
        _PROXIES.by_uri[uri] = ServerProxy(uri)
    return _PROXIES.by_uri[uri]


def remove_server_proxy(uri: str) -> None:
    """Remove the proxy for a URI. Call this after its server has exited."""
    _PROXIES.by_uri.pop(uri, None)


def close_half_closed_sockets() -> None:
    """Close this thread's proxy connections that the server has closed."""
    if not hasattr(socket, "TCP_INFO"):
        return
    for proxy in _PROXIES.by_uri.values():
        transport: Any = proxy("transport")
        connection = transport._connection and transport._connection[1]
        if connection is None or connection.sock is None:
            continue
        try:
            state = connection.sock.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO)
        except OSError as error:
            if error.errno == errno.ENOPROTOOPT:
                return
            raise
        if state == _CLOSE_WAIT:
            transport.close()
