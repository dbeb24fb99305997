"""rosmaster.util: XML-RPC server proxies, one per thread and URI."""

from __future__ import annotations

import threading
from urllib.parse import urlparse
from xmlrpc.client import ServerProxy

__all__ = ["remove_server_proxy", "xmlrpcapi"]


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
    """Remove the proxy for a URI; call this when its server has exited."""
    _PROXIES.by_uri.pop(uri, None)
