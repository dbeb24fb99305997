"""rosnode: provides information about nodes, and shuts them down. Source: http://wiki.ros.org/rosnode."""

from __future__ import annotations

import re
import socket
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NoReturn

from minirospy.base.errors import MasterUnreachableError, MinirospyError, NodeUnreachableError, NotFoundError
from minirospy.introspect import nodes
from minirospy.introspect.graph import Graph, NodeAddress, node_host
from minirospy.introspect.texts import connections_text, node_text
from minirospy.ros.rosgraph.rosgraph import masterapi
from minirospy.ros.rosgraph.rosgraph.names import script_resolve_name
from minirospy.runtime.rpc.master_proxy import MasterProxy

if TYPE_CHECKING:
    import rosgraph as rosgraph

__all__ = [
    "CONNECTION_PATTERN",
    "ID",
    "NAME",
    "ROSNodeException",
    "ROSNodeIOException",
    "_fullusage",
    "_rosnode_cmd_cleanup",
    "_rosnode_cmd_info",
    "_rosnode_cmd_kill",
    "_rosnode_cmd_list",
    "_rosnode_cmd_machine",
    "_rosnode_cmd_ping",
    "_sub_rosnode_listnodes",
    "_succeed",
    "cleanup_master_blacklist",
    "cleanup_master_whitelist",
    "get_api_uri",
    "get_machines_by_nodes",
    "get_node_connection_info_description",
    "get_node_info_description",
    "get_node_names",
    "get_nodes_by_machine",
    "kill_nodes",
    "lookup_uri",
    "rosnode_cleanup",
    "rosnode_debugnode",
    "rosnode_info",
    "rosnode_listnodes",
    "rosnode_ping",
    "rosnode_ping_all",
    "rosnodemain",
]

NAME = "rosnode"
ID = "/rosnode"
CONNECTION_PATTERN = re.compile(r"\w+ connection on port (\d+) to \[(.*) on socket (\d+)\]")
_RULE = "-" * 80
_PING_SECONDS = 3.0


class ROSNodeException(Exception):
    """Raised if a request about a node failed."""


class ROSNodeIOException(ROSNodeException):
    """Raised if the master or the node does not respond."""


def get_node_names(namespace: str | None = None) -> list[str]:
    """Return the names of the nodes in ``namespace``, or of all nodes.

    Raise ROSNodeIOException if the master does not respond.
    """
    with _graph() as graph:
        return nodes.list_nodes(graph, graph.resolve(namespace) if namespace else "/")


def get_api_uri(master: masterapi.Master, caller_id: str, skip_cache: bool = False) -> str | None:
    """Return a node's URI, or None if the node is not registered. Always queries the master."""
    with _graph(master) as graph:
        return graph.node_uri(caller_id)


def lookup_uri(master: masterapi.Master, system_state: Sequence[Any], topic: str, uri: str) -> str:
    """Return `NODE (URI)` if a node that uses ``topic`` in ``system_state`` has this URI, otherwise only the URI."""
    from minirospy.ros.rostopic.rostopic import get_api

    for rows in system_state[:2]:
        for row in rows:
            for node in row[1] if row[0] == topic else ():
                if get_api(master, node) == uri:
                    return f"{node} ({uri})"
    return uri


def get_node_info_description(node_name: str) -> str:
    """Return the master's information about a node, formatted like `rosnode info`.

    Raise ROSNodeIOException if the master does not respond.
    """
    with _graph() as graph:
        name = graph.resolve(node_name)
        try:
            return node_text(nodes.node_detail(graph, name))
        except NotFoundError:
            return node_text(nodes.NodeDetail(name, None, [], [], []))


def get_node_connection_info_description(node_api: str, master: masterapi.Master) -> str:
    """Return the process id and connections of the node at ``node_api``, formatted like `rosnode info`.

    Raise ROSNodeIOException if the node does not respond.
    """
    with _graph(master) as graph:
        try:
            return connections_text(graph, nodes.node_connections(graph, NodeAddress(node_api, node_api)))
        except NodeUnreachableError as error:
            raise ROSNodeIOException(f"Communication with node[{node_api}] failed!") from error


def rosnode_ping(
    node_name: str, max_count: int | None = None, verbose: bool = False, skip_cache: bool = False
) -> bool:
    """Return whether a node responds to ``max_count`` pings. If ``max_count`` is None, ping until a ping fails.

    Raise ROSNodeIOException if the master does not respond. The reason for a failure is always printed to stderr,
    everything else only if ``verbose``.
    """
    with _graph() as graph:
        name = graph.resolve(node_name)
        uri = graph.node_uri(name)
        if uri is None:
            print(f"cannot ping [{name}]: unknown node", file=sys.stderr)
            return False
        if verbose:
            _announce(name)
        times: list[float] = []
        while max_count is None or len(times) < max_count:
            if times:
                time.sleep(1.0)
            seconds = _ping(graph, NodeAddress(name, uri), verbose)
            if seconds is None:
                return False
            times.append(seconds)
        if verbose and len(times) > 1:
            print(f"ping average: {sum(times) / len(times) * 1000.0:f}ms")
    return True


def rosnode_ping_all(verbose: bool = False, skip_cache: bool = False) -> tuple[list[str], list[str]]:
    """Return (responding nodes, other nodes). Raise ROSNodeIOException if the master does not respond."""
    answering: list[str] = []
    silent: list[str] = []
    with _graph() as graph:
        found = graph.addresses(nodes.list_nodes(graph))
        if verbose:
            print("Will ping the following nodes: \n" + "".join(f" * {node.name}\n" for node in found))
        for node in found:
            if verbose:
                _announce(node.name)
            answers = node.uri is not None and _ping(graph, node, verbose) is not None
            (answering if answers else silent).append(node.name)
    return answering, silent


def kill_nodes(node_names: list[str]) -> tuple[list[str], list[str]]:
    """Ask nodes to shut down; return (notified nodes, unknown or unreachable nodes).

    Without a master, all nodes are unknown.
    """
    notified: list[str] = []
    unknown: list[str] = []
    try:
        with _graph() as graph:
            for node in graph.addresses(node_names):
                if node.uri is None:
                    unknown.append(node.name)
                    continue
                try:
                    nodes.kill_node(graph, node)
                    notified.append(node.name)
                except NodeUnreachableError:
                    unknown.append(node.name)
    except ROSNodeIOException:
        unknown = [name for name in node_names if name not in notified]
    return notified, unknown


def cleanup_master_blacklist(master: masterapi.Master, blacklist: Sequence[str]) -> None:
    """Unregister the nodes in ``blacklist`` from the master and print their names.

    As in ROS, raise ConnectionRefusedError if no master responds.
    """
    with _graph(master, ConnectionRefusedError) as graph:
        # Query the master even for an empty list, because an unreachable master is an error.
        graph.state()
        for node in graph.addresses(blacklist):
            print(f"Unregistering {node.name}")
            nodes.forget_node(graph, node)


def cleanup_master_whitelist(master: masterapi.Master, whitelist: Sequence[str]) -> None:
    """Unregister all nodes except those in ``whitelist`` from the master.

    As in ROS, raise ConnectionRefusedError if no master responds.
    """
    with _graph(master, ConnectionRefusedError) as graph:
        for node in graph.addresses(name for name in nodes.list_nodes(graph) if name not in whitelist):
            nodes.forget_node(graph, node)


def get_machines_by_nodes() -> list[str]:
    """Return the machines that nodes run on."""
    with _graph() as graph:
        hosts = (node_host(node.uri) for node in graph.addresses(nodes.list_nodes(graph)))
        return sorted({host for host in hosts if host})


def get_nodes_by_machine(machine: str) -> list[str]:
    """Return the nodes on a machine. Raise ROSNodeException if the machine's name cannot be resolved."""
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
    """Print the output of `rosnode list`."""
    print(_sub_rosnode_listnodes(namespace, list_uri, list_all))


def rosnode_info(node_name: str, quiet: bool = False) -> None:
    """Print the output of `rosnode info`; if ``quiet``, without querying the node.

    Raise ROSNodeIOException if the master does not respond.
    """
    print(f"{_RULE}\n{get_node_info_description(node_name)}")
    if quiet:
        return
    with _graph() as graph:
        name = graph.resolve(node_name)
        uri = graph.node_uri(name)
    if uri is None:
        print(f"cannot contact [{name}]: unknown node", file=sys.stderr)
        return
    print(f"\ncontacting node {uri} ...")
    print(get_node_connection_info_description(uri, masterapi.Master(ID)))


rosnode_debugnode = rosnode_info


def rosnode_cleanup() -> None:
    """Run `rosnode cleanup`, which prompts for confirmation. Raise ROSNodeIOException if the master does not respond."""
    from minirospy.ros.rosnode.commands.rosnode import main

    with _graph() as graph:
        graph.master.get_pid()
    main(["cleanup"])


def rosnodemain(argv: Sequence[str] | None = None) -> NoReturn:
    """Run the command and, as in ROS, exit with its status. ``argv`` starts with the command's name."""
    from minirospy.ros.rosnode.commands.rosnode import main

    sys.exit(main(list(sys.argv if argv is None else argv)[1:]))


# Programs call the following private functions of ROS's rosnode.


def _run_verb(name: str, argv: Sequence[str]) -> int | None:
    from minirospy.command.called import Raised, call_verb
    from minirospy.ros.rosnode.commands.rosnode import FAMILY

    return call_verb(FAMILY, [name, *argv[2:]], Raised(ROSNodeException, ROSNodeIOException))


def _verb(name: str) -> Callable[[Sequence[str]], None]:
    """Return a function that runs a verb. Its argument is a command line, starting with the command's name and the verb."""

    def call(argv: Sequence[str]) -> None:
        _run_verb(name, argv)

    return call


_rosnode_cmd_cleanup = _verb("cleanup")
_rosnode_cmd_info = _verb("info")
_rosnode_cmd_list = _verb("list")
_rosnode_cmd_machine = _verb("machine")
_rosnode_cmd_ping = _verb("ping")


def _rosnode_cmd_kill(argv: Sequence[str]) -> int:
    """Run `rosnode kill`; return its exit status. Raise ROSNodeException if a name is not a node."""
    names = [script_resolve_name(ID, word) for word in argv[2:] if not word.startswith("-")]
    if names:
        try:
            known = get_node_names()
        except ROSNodeIOException:
            raise ROSNodeIOException("Unable to communicate with master!") from None
        unknown = [name for name in names if name not in known]
        if unknown and len(names) == len(argv[2:]):
            raise ROSNodeException("\n * ".join(["Unknown node(s):", *unknown]))
    return _run_verb("kill", argv) or 0


def _fullusage(return_error: bool = True) -> NoReturn:
    """Print the list of commands and exit, with the status of a usage error if ``return_error``, otherwise 0."""
    from minirospy.ros.rosnode.commands.rosnode import main

    status = main([])
    sys.exit(status if return_error else 0)


def _sub_rosnode_listnodes(
    namespace: str | None = None, list_uri: bool = False, list_all: bool = False
) -> str:
    """Return the output lines of `rosnode list`."""
    with _graph() as graph:
        found = graph.addresses(get_node_names(namespace))
    if list_all:
        return "\n".join(f"{node.uri or 'unknown address'} \t{node.name}" for node in found)
    return "\n".join((node.uri or "unknown address") if list_uri else node.name for node in found)


def _succeed(args: Sequence[object]) -> object:
    """Return the value of a response (code, status message, value). Raise ROSNodeException if it is an error."""
    code, text, value = args
    if code != 1:
        raise ROSNodeException(f"remote call failed: {text}")
    return value


def _announce(name: str) -> None:
    print(f"pinging {name} with a timeout of {_PING_SECONDS}s")


def _ping(graph: Graph, node: NodeAddress, verbose: bool) -> float | None:
    """Ping a node and return the round-trip time in seconds, or print an error and return None if it does not respond."""
    try:
        seconds = nodes.ping_node(graph, node, _PING_SECONDS)
    except NodeUnreachableError as error:
        print(f"ERROR: {error}", file=sys.stderr)
        return None
    if verbose:
        print(f"xmlrpc reply from {node.uri}\ttime={seconds * 1000.0:f}ms")
    return seconds


def _address(host: str) -> str | None:
    try:
        return socket.gethostbyname(host)
    except OSError:
        return None


@contextmanager
def _graph(
    master: masterapi.Master | None = None, unreachable: type[Exception] = ROSNodeIOException
) -> Iterator[Graph]:
    """Yield the graph of ``master`` (default: the environment's master), converting errors to this module's exceptions."""
    # Old scripts pass a ServerProxy, whose attributes are objects but never strings.
    uri = getattr(master, "master_uri", None)
    try:
        with Graph(MasterProxy(uri, ID), NAME) if isinstance(uri, str) else Graph.open(NAME) as graph:
            yield graph
    except MasterUnreachableError as error:
        raise unreachable(error.ros_text) from error
    except MinirospyError as error:
        raise ROSNodeException(str(error)) from error
