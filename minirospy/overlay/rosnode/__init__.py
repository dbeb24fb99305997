"""rosnode, filled in by minirospy: what user code asks of nodes. Source: http://wiki.ros.org/rosnode."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

from minirospy.errors import MasterUnreachableError, MinirospyError, NodeUnreachableError
from minirospy.introspect import nodes
from minirospy.introspect.graph import Graph, NodeAddress, node_host

__all__ = [
    "ROSNodeException", "ROSNodeIOException", "get_api_uri", "get_machines_by_nodes", "get_node_names",
    "get_nodes_by_machine", "kill_nodes", "rosnode_ping", "rosnode_ping_all",
]  # fmt: skip


class ROSNodeException(Exception):
    """A node cannot be used as asked."""


class ROSNodeIOException(ROSNodeException):
    """The master does not answer."""


def get_node_names(namespace: str | None = None) -> list[str]:
    """The names of the nodes at or below ``namespace``. Raises ROSNodeIOException."""
    with _graph() as graph:
        return nodes.list_nodes(graph, graph.resolve(namespace) if namespace else "/")


def get_api_uri(master: object, caller_id: str, skip_cache: bool = False) -> str | None:
    """The URI of a node; None where the master does not know it."""
    with _graph() as graph:
        return graph.node_uri(caller_id)


def rosnode_ping(
    node_name: str, max_count: int | None = None, verbose: bool = False, skip_cache: bool = False
) -> bool:
    """Whether a node answers ``max_count`` pings (None: pings until it does not). Raises ROSNodeIOException."""
    with _graph() as graph:
        name = graph.resolve(node_name)
        uri = graph.node_uri(name)
        if uri is None:
            if verbose:
                print(f"cannot ping [{name}]: unknown node")
            return False
        if verbose:
            print(f"pinging {name} with a timeout of 3.0s")
        count = 0
        while max_count is None or count < max_count:
            if count:
                time.sleep(1.0)
            if not _answers(graph, NodeAddress(name, uri), verbose):
                return False
            count += 1
    return True


def rosnode_ping_all(verbose: bool = False) -> tuple[list[str], list[str]]:
    """(nodes that answer, nodes that do not). Raises ROSNodeIOException."""
    with _graph() as graph:
        answers = {
            node.name: node.uri is not None and _answers(graph, node, verbose)
            for node in graph.addresses(nodes.list_nodes(graph))
        }
    return [name for name, well in answers.items() if well], [
        name for name, well in answers.items() if not well
    ]


def kill_nodes(node_names: list[str]) -> tuple[list[str], list[str]]:
    """Ask nodes to shut down; (asked, unknown). Raises ROSNodeIOException."""
    asked, unknown = [], []
    with _graph() as graph:
        for node in graph.addresses(node_names):
            if node.uri is None:
                unknown.append(node.name)
            else:
                nodes.kill_node(graph, node)
                asked.append(node.name)
    return asked, unknown


def get_machines_by_nodes() -> list[str]:
    """The machines that nodes run on."""
    with _graph() as graph:
        hosts = (node_host(node.uri) for node in graph.addresses(nodes.list_nodes(graph)))
        return sorted({host for host in hosts if host})


def get_nodes_by_machine(machine: str) -> list[str]:
    """The nodes on a machine."""
    with _graph() as graph:
        return [
            node.name for node in graph.addresses(nodes.list_nodes(graph)) if node_host(node.uri) == machine
        ]


def _answers(graph: Graph, node: NodeAddress, verbose: bool) -> bool:
    try:
        seconds = nodes.ping_node(graph, node)
    except NodeUnreachableError as error:
        if verbose:
            print(f"ERROR: {error}")
        return False
    if verbose:
        print(f"xmlrpc reply from {node.uri}\ttime={seconds * 1000.0:f}ms")
    return True


@contextmanager
def _graph() -> Iterator[Graph]:
    try:
        with Graph.open("rosnode") as graph:
            yield graph
    except MasterUnreachableError as error:
        raise ROSNodeIOException(str(error)) from error
    except MinirospyError as error:
        raise ROSNodeException(str(error)) from error
