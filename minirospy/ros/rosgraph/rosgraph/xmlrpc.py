"""rosgraph.xmlrpc: an XML-RPC server in a thread, for programs that implement a node themselves.

It is based on Python's xmlrpc; minirospy's own nodes do not use it.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from socketserver import ThreadingMixIn
from xmlrpc.server import SimpleXMLRPCRequestHandler as SimpleXMLRPCRequestHandler
from xmlrpc.server import SimpleXMLRPCServer as SimpleXMLRPCServer

from minirospy.ros.ros_names import isstring
from minirospy.ros.rosgraph.rosgraph.network import create_local_xmlrpc_uri, get_bind_address
from minirospy.ros.submodules import modules_on_first_use

__all__ = [
    "SilenceableXMLRPCRequestHandler",
    "ThreadingXMLRPCServer",
    "XmlRpcHandler",
    "XmlRpcNode",
    "isstring",
]

__getattr__ = modules_on_first_use(
    "rosgraph.xmlrpc",
    "_thread errno logging platform rosgraph select socket socketserver traceback",
)

_log = logging.getLogger("xmlrpc")


class SilenceableXMLRPCRequestHandler(SimpleXMLRPCRequestHandler):
    """Handles HTTP/1.1 requests, and logs them only if the server's ``logRequests`` is set."""

    protocol_version = "HTTP/1.1"
    rpc_paths = ()

    def log_message(self, format: str, *args: object) -> None:
        """Log a request if the server logs requests."""
        if getattr(self.server, "logRequests", False):
            super().log_message(format, *args)


class ThreadingXMLRPCServer(ThreadingMixIn, SimpleXMLRPCServer):
    """Handles each connection in a separate thread."""

    daemon_threads = True
    allow_reuse_address = True

    def __init__(self, addr: tuple[str, int], log_requests: int = 1) -> None:
        super().__init__(addr, SilenceableXMLRPCRequestHandler, bool(log_requests))

    def handle_error(self, request: object, client_address: object) -> None:
        """Log an error, such as a disconnected peer, at debug level only."""
        _log.debug("connection from %s", client_address, exc_info=True)


class XmlRpcHandler:
    """The base class for the methods served by an :class:`XmlRpcNode`; names with a leading underscore are not served."""

    def _ready(self, uri: str) -> None:
        """Handle the server's start at ``uri``; subclasses override this method."""

    def _shutdown(self, reason: str) -> None:
        """Handle the server's shutdown; subclasses override this method."""


class XmlRpcNode:
    """Serves the methods of ``rpc_handler`` in a thread after :meth:`start`; ``uri`` is the server's address.

    If the server's thread fails, ``on_run_error`` is called with the exception.
    """

    def __init__(
        self,
        port: int | str | None = 0,
        rpc_handler: XmlRpcHandler | None = None,
        on_run_error: Callable[[Exception], object] | None = None,
    ) -> None:
        self.handler = rpc_handler
        self.uri: str | None = None
        self.server: ThreadingXMLRPCServer | None = None
        self.port = int(port) if port and isinstance(port, str) else port
        self.is_shutdown = False
        self.on_run_error = on_run_error

    def shutdown(self, reason: str) -> None:
        """Stop the server. Idempotent."""
        if self.is_shutdown:
            return
        self.is_shutdown = True
        if self.server is not None:
            self.server.shutdown()
            self.server.server_close()
        if isinstance(self.handler, XmlRpcHandler):
            self.handler._shutdown(reason)

    def start(self) -> None:
        """Start a thread that runs the server."""
        threading.Thread(target=self.run, daemon=True).start()

    def set_uri(self, uri: str) -> None:
        """Set the URI, replacing the one derived from the environment."""
        self.uri = uri

    def run(self) -> None:
        """Run the server in the calling thread until :meth:`shutdown` is called."""
        try:
            self.server = ThreadingXMLRPCServer((get_bind_address(), int(self.port or 0)), log_requests=False)
            self.port = self.server.server_address[1]
            self.set_uri(self.uri or create_local_xmlrpc_uri(self.port))
            self.server.register_multicall_functions()
            self.server.register_instance(self.handler)
            if isinstance(self.handler, XmlRpcHandler):
                self.handler._ready(str(self.uri))
            self.server.serve_forever(poll_interval=0.1)
        except Exception as error:  # reported through ``on_run_error``
            if self.on_run_error is None:
                raise
            self.on_run_error(error)
