"""rosnode, filled in by minirospy: what user code asks of nodes. Source: http://wiki.ros.org/rosnode."""

from __future__ import annotations

import socket
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from minirospy.errors import MasterUnreachableError, MinirospyError, NodeUnreachableError
from minirospy.introspect import nodes
from minirospy.introspect.graph import Graph, NodeAddress, node_host

__all__ = [
    "ID", "NAME", "ROSNodeException", "ROSNodeIOException", "get_api_uri", "get_machines_by_nodes", "get_node_names",
    "get_nodes_by_machine", "kill_nodes", "rosnode_cleanup", "rosnode_info", "rosnode_listnodes", "rosnode_ping",
    "rosnode_ping_all", "rosnodemain",
]  # fmt: skip

NAME = "rosnode"
ID = "/rosnode"


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
                print(f"cannot ping [{name}]: unknown node", file=sys.stderr)
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


def rosnode_ping_all(verbose: bool = False, skip_cache: bool = False) -> tuple[list[str], list[str]]:
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
    """The nodes on a machine. Raises ROSNodeException where its name does not resolve."""
    try:
        wanted = socket.gethostbyname(machine)
    except OSError as error:
        raise ROSNodeException(f"cannot resolve machine name [{machine}] to address") from error
    with _graph() as graph:
        return [
            node.name
            for node in graph.addresses(nodes.list_nodes(graph))
            if (host := node_host(node.uri)) and (host == machine or _address(host) == wanted)
        ]


def rosnode_listnodes(namespace: str | None = None, list_uri: bool = False, list_all: bool = False) -> None:
    """Print what `rosnode list` prints."""
    rosnodemain(
        ["rosnode", "list", *(["-u"] * list_uri), *(["-a"] * list_all), *([namespace] if namespace else [])]
    )


def rosnode_info(node_name: str, quiet: bool = False) -> None:
    """Print what `rosnode info` prints."""
    rosnodemain(["rosnode", "info", *(["-q"] * quiet), node_name])


def rosnode_cleanup() -> None:
    """What `rosnode cleanup` does, its question included."""
    rosnodemain(["rosnode", "cleanup"])


def rosnodemain(argv: Sequence[str] | None = None) -> int:
    """The command; ``argv`` begins with its name. Its exit status."""
    from minirospy.cli.rosnode import main

    return main(list(sys.argv if argv is None else argv)[1:])


def _address(host: str) -> str | None:
    try:
        return socket.gethostbyname(host)
    except OSError:
        return None


def _answers(graph: Graph, node: NodeAddress, verbose: bool) -> bool:
    try:
        seconds = nodes.ping_node(graph, node)
    except NodeUnreachableError as error:
        if verbose:
            print(f"ERROR: {error}", file=sys.stderr)
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
