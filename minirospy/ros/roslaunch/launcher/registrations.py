"""Removes exited nodes' registrations from the master.

The guardian of a killed roslaunch runs this module as a program:

``python -m minirospy.ros.roslaunch.launcher.registrations MASTER_URI NODE ...``.
"""

from __future__ import annotations

import contextlib
import queue
import sys
import threading
from collections.abc import Collection, Sequence

from minirospy.base.errors import MasterUnreachableError, RpcError
from minirospy.introspect.graph import Graph, NodeAddress
from minirospy.runtime.rpc.master_proxy import MasterProxy, SystemState

__all__ = ["DeadNodes", "main", "unregister_dead"]

# timeout in seconds for a node's response; only a hanging node reaches it, because exited ones refuse connections
_ANSWER_SECONDS = 5.0

_MAX_CONCURRENT = 16


class DeadNodes:
    """Unregisters exited nodes in a thread; each pass handles all exits since the previous one."""

    def __init__(self, master_uri: str) -> None:
        self._master_uri = master_uri
        self._exited: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._thread: threading.Thread | None = None

    def add(self, node: str) -> None:
        """Schedule a node (global name) to be unregistered."""
        if self._thread is None:
            # Import these here: in the thread, an import that fails, for example after an update, would go unnoticed.
            import concurrent.futures.thread  # noqa: F401

            import minirospy.introspect.nodes  # noqa: F401

            self._thread = threading.Thread(target=self._run, name="dead-nodes", daemon=True)
            self._thread.start()
        self._exited.put(node)

    def close(self) -> None:
        """Wait until all added nodes are unregistered, or give up if the master does not respond. Idempotent."""
        if self._thread:
            self._exited.put(None)
            self._thread.join()
            self._thread = None

    def _run(self) -> None:
        is_open = True
        while is_open:
            names = [self._exited.get()]
            with contextlib.suppress(queue.Empty):
                while True:
                    names.append(self._exited.get_nowait())
            is_open = None not in names
            unregister_dead(self._master_uri, {name for name in names if name})


def unregister_dead(master_uri: str, nodes: Collection[str]) -> list[str]:
    """Unregister the ``nodes`` (global names) that have exited; return their names.

    A node that is running or hangs stays registered, and so does a new node with one of these names. If the master does not
    respond, nothing is changed.
    """
    if not nodes:
        return []
    # Import this, and minirospy.introspect.nodes, here: a launch needs them only after a node has exited.
    from concurrent.futures import ThreadPoolExecutor

    try:
        with Graph(MasterProxy(master_uri, "/roslaunch"), "roslaunch") as graph:
            state = graph.state()
            registered = {name for table in state for names in table.values() for name in names}
            left = [node for node in graph.addresses(sorted(registered.intersection(nodes))) if node.uri]
            with ThreadPoolExecutor(_MAX_CONCURRENT) as pool:
                return [name for name in pool.map(lambda node: _unregister(graph, node, state), left) if name]
    except (MasterUnreachableError, RpcError):
        return []


def main(argv: Sequence[str]) -> int:
    """Unregister nodes. ``argv`` holds the master's URI and the nodes' names."""
    unregister_dead(argv[0], argv[1:])
    return 0


def _unregister(graph: Graph, node: NodeAddress, state: SystemState) -> str:
    from minirospy.introspect.nodes import forget_node, has_exited

    if not has_exited(graph, node, _ANSWER_SECONDS):
        return ""
    forget_node(graph, node, state)
    return node.name


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
