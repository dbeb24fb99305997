"""rosgraph.xmlrpc: an XML-RPC server in a thread, for programs that implement a node themselves.

The server is based on Python's xmlrpc; minirospy's own nodes do not use it.
"""

from __future__ import annotations

import errno
import logging
import threading
from collections.abc import Callable
from socketserver import ThreadingMixIn
from xmlrpc.server import SimpleXMLRPCRequestHandler as SimpleXMLRPCRequestHandler
from xmlrpc.server import SimpleXMLRPCServer as SimpleXMLRPCServer

from minirospy.ros.ros_names import isstring
from minirospy.ros.rosgraph.rosgraph.network import create_local_xmlrpc_uri, get_bind_address

__all__ = [
    "SilenceableXMLRPCRequestHandler",
    "ThreadingXMLRPCServer",
    "XmlRpcHandler",
    "XmlRpcNode",
    "isstring",
]

_log = logging.getLogger("xmlrpc")


class SilenceableXMLRPCRequestHandler(SimpleXMLRPCRequestHandler):
    """Handles HTTP/1.1 requests and logs them only if the server's ``logRequests`` is set."""

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
        self._serving = threading.Lock()
        # without this flag, shutdown() would wait forever if serve_forever() was never called
        self._is_serving = False
        self._is_closed = False

    def serve_forever(self, poll_interval: float = 0.5) -> None:
        """Handle requests until :meth:`close` is called; return immediately if it has already been called."""
        with self._serving:
            if self._is_closed:
                return
            self._is_serving = True
        super().serve_forever(poll_interval)

    def close(self) -> None:
        """Stop handling requests and close the socket."""
        with self._serving:
            self._is_closed = True
        if self._is_serving:
            self.shutdown()
        self.server_close()

    def handle_error(self, request: object, client_address: object) -> None:
        """Log an error, such as a disconnected peer, only at debug level."""
        _log.debug("connection from %s", client_address, exc_info=True)


class XmlRpcHandler:
    """Base class of objects served by an :class:`XmlRpcNode`, which serves all methods without a leading underscore."""

    def _ready(self, uri: str) -> None:
        """Do nothing. Called when the server has started at ``uri``; subclasses may override this method."""

    def _shutdown(self, reason: str) -> None:
        """Do nothing. Called when the server shuts down; subclasses may override this method."""


class XmlRpcNode:
    """Serves the methods of ``rpc_handler`` in a thread after :meth:`start`. ``uri`` is the server's address.

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
        server, self.server = self.server, None
        if server is not None:
            server.close()
        if isinstance(self.handler, XmlRpcHandler):
            self.handler._shutdown(reason)

    def start(self) -> None:
        """Start a thread that runs the server."""
        threading.Thread(target=self.run, daemon=True).start()

    def set_uri(self, uri: str) -> None:
        """Set the node's URI; the server calls this when it starts."""
        self.uri = uri

    def run(self) -> None:
        """Run the server in the calling thread until :meth:`shutdown` is called."""
        try:
            self._run()
        except Exception as error:  # reported through ``on_run_error``
            if self.on_run_error is None:
                raise
            self.on_run_error(error)

    def _run(self) -> None:
        """Start the server and handle requests. Subclasses may override this method to add steps."""
        self._run_init()
        if self.server is not None:
            self.server.serve_forever(poll_interval=0.1)

    def _run_init(self) -> None:
        """Start the server and set ``uri`` without handling requests. Raise OSError if the port is unavailable."""
        address, port = get_bind_address(), int(self.port or 0)
        _log.info("XML-RPC server binding to %s:%d", address, port)
        try:
            server = self.server = ThreadingXMLRPCServer((address, port), log_requests=False)
        except OSError as error:
            why = f": {error.strerror}"
            if error.errno == errno.EADDRINUSE:
                why = f", port {port} is already in use"
            text = f"ERROR: Unable to start XML-RPC server{why}"
            _log.error(text)
            print(text)
            raise

        self.port = server.server_address[1]
        self.set_uri(create_local_xmlrpc_uri(self.port))
        _log.info("Started XML-RPC server [%s]", self.uri)
        server.register_multicall_functions()
        server.register_instance(self.handler)
        if isinstance(self.handler, XmlRpcHandler):
            self.handler._ready(str(self.uri))
        _log.info("xml rpc node: starting XML-RPC server")
