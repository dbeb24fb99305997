"""rosgraph.xmlrpc.XmlRpcNode: subclasses override the steps of its start, or call them themselves."""

import logging
import socket
import sys
import threading
import xmlrpc.client

import rosgraph.xmlrpc
from referee import outcome, printed, show


class Lines(logging.Handler):
    """Prints log records."""

    def emit(self, record):
        show("log", record.name, record.levelname, record.getMessage())


logging.getLogger("xmlrpc").addHandler(Lines())
logging.getLogger("xmlrpc").setLevel(logging.INFO)


class Handler(rosgraph.xmlrpc.XmlRpcHandler):
    """Serves one method."""

    def _ready(self, uri):
        show("ready", node.uri == uri, node.server is not None)

    def _shutdown(self, reason):
        show("shutdown", reason)

    def hello(self, value):
        """Return the value."""
        return [1, "", value]


class Node(rosgraph.xmlrpc.XmlRpcNode):
    """Shows the steps of the start."""

    def _run_init(self):
        show("run_init", self.uri)
        super()._run_init()
        show("after", self.port > 0, self.uri, type(self.server).__name__)
        started.set()

    def _run(self):
        show("run")
        super()._run()

    def set_uri(self, uri):
        show("set_uri", uri)
        super().set_uri(uri)


started = threading.Event()
node = Node(0, Handler())
show(sorted(name for name in vars(node) if not name.startswith("_")))
node.set_uri("http://mine:5/")
node.start()
started.wait()
show(xmlrpc.client.ServerProxy(node.uri).hello("a"))
node.shutdown("bye")
node.shutdown("again")
show(node.is_shutdown, node.server)

show("# the first step only")
node = Node(0, Handler())
node._run_init()
threading.Thread(target=node.server.handle_request, daemon=True).start()
show(xmlrpc.client.ServerProxy(node.uri).hello("b"))
node.shutdown("done")

show("# errors")
taken = socket.socket()
taken.bind(("127.0.0.1", 0))
taken.listen(1)
PORT = taken.getsockname()[1]


def start(**options):
    """Start a node on a port that is taken."""
    node = rosgraph.xmlrpc.XmlRpcNode(PORT, Handler(), **options)
    node.run()


logging.getLogger("xmlrpc").setLevel(logging.CRITICAL)
printed("taken", start, (str(PORT), "<port>"), texts=False)
name_of = lambda error: sys.stdout.write(type(error).__name__)  # noqa: E731
printed("reported", lambda: start(on_run_error=name_of), (str(PORT), "<port>"))
Node._run = lambda self: 1 / 0
outcome("run", lambda: Node(0, Handler(), on_run_error=show).run())
Node._run = rosgraph.xmlrpc.XmlRpcNode._run
Node._run_init = lambda self: 1 / 0
outcome("run_init", lambda: Node(0, Handler(), on_run_error=show).run())
