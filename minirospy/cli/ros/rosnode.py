"""rosnode: which nodes there are, what they do, whether they answer; stopping them.

Source: http://wiki.ros.org/rosnode. What is printed is what ROS prints.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence

from minirospy.cli.command import Parser, complain
from minirospy.cli.verbs import Family, Verb
from minirospy.errors import NodeUnreachableError, NotFoundError, UsageError
from minirospy.introspect.graph import Graph, NodeAddress
from minirospy.introspect.nodes import (
    NodeDetail,
    find_node,
    forget_node,
    kill_node,
    list_nodes,
    node_connections,
    node_detail,
    node_hosts,
    nodes_on,
    ping_node,
    unreachable_nodes,
)
from minirospy.introspect.texts import connections_text, node_text

__all__ = ["main"]

_PING_SECONDS = 3.0
_RULE = "-" * 80


def main(argv: Sequence[str] | None = None) -> int:
    """The command; its exit status."""
    return _FAMILY.main(argv)


def _ping(argv: Sequence[str]) -> int:
    parser = Parser("rosnode ping", description="Call a node once a second and print how long it takes.")
    parser.add_argument("node", nargs="?", help="the node's name")
    parser.add_argument("-a", "--all", action="store_true", help="ping all nodes once")
    parser.add_argument(
        "-c", dest="count", type=int, default=0, metavar="COUNT", help="number of pings to send"
    )
    options = parser.parse_args(argv)
    if options.all and (options.node or options.count):
        parser.error("-a pings all nodes once: it takes neither a name nor -c")
    with Graph.open("rosnode") as graph:
        if options.all:
            return _ping_all(graph)
        if not options.node:
            nodes = list_nodes(graph)
            raise UsageError(f"please enter a node to ping: {' '.join(nodes) or 'there are none'}")
        node = find_node(graph, graph.resolve(options.node))
        print(f"rosnode: node is [{node.name}]")
        print(f"pinging {node.name} with a timeout of {_PING_SECONDS}s", flush=True)
        times: list[float] = []
        try:
            while True:
                _ping_once(graph, node, times)
                if len(times) == options.count:
                    break
                time.sleep(1.0)
        except KeyboardInterrupt:
            pass
        if times and options.count != 1:
            print(f"ping average: {sum(times) / len(times):f}ms")
        return 0


def _ping_all(graph: Graph) -> int:
    nodes = graph.addresses(list_nodes(graph))
    print("Will ping the following nodes: \n" + "".join(f" * {node.name}\n" for node in nodes))
    silent = 0
    for node in nodes:
        print(f"pinging {node.name} with a timeout of {_PING_SECONDS}s", flush=True)
        try:
            _ping_once(graph, node, [])
        except NodeUnreachableError as error:
            complain("rosnode", error)
            silent += 1
    return 1 if silent else 0


def _ping_once(graph: Graph, node: NodeAddress, times: list[float]) -> None:
    """Ping and print; the milliseconds are in ``times`` before the line is seen, whoever then types Ctrl-C."""
    times.append(ping_node(graph, node, _PING_SECONDS) * 1000.0)
    print(f"xmlrpc reply from {node.uri}\ttime={times[-1]:f}ms", flush=True)


def _list(argv: Sequence[str]) -> None:
    parser = Parser("rosnode list", description="List the nodes, or those in a namespace.")
    parser.add_argument("namespace", nargs="?", help="only nodes at or below this name")
    parser.add_argument("-u", dest="uris", action="store_true", help="list XML-RPC URIs")
    parser.add_argument("-a", "--all", action="store_true", help="list names and URIs")
    options = parser.parse_args(argv)
    with Graph.open("rosnode") as graph:
        nodes = list_nodes(graph, graph.resolve(options.namespace) if options.namespace else "/")
        if options.all:
            lines = [f"{node.uri or 'unknown address'} \t{node.name}" for node in graph.addresses(nodes)]
        elif options.uris:
            lines = [node.uri or "unknown address" for node in graph.addresses(nodes)]
        else:
            lines = nodes
        print("\n".join(lines))


def _info(argv: Sequence[str]) -> int:
    parser = Parser(
        "rosnode info", description="Print what nodes publish, subscribe to, serve, and their connections."
    )
    parser.add_argument("nodes", nargs="+", metavar="node", help="names of nodes")
    parser.add_argument("-q", "--quiet", action="store_true", help="only what the master knows; ask no node")
    options = parser.parse_args(argv)
    with Graph.open("rosnode") as graph:
        failed = 0
        for name in options.nodes:
            try:
                detail = node_detail(graph, graph.resolve(name))
            except NotFoundError as error:
                complain("rosnode", error)
                failed += 1
                continue
            print(f"{_RULE}\n{node_text(detail)}")
            if not options.quiet:
                failed += not _print_connections(graph, detail)
        return 1 if failed else 0


def _print_connections(graph: Graph, detail: NodeDetail) -> bool:
    print(f"\ncontacting node {detail.uri} ...", flush=True)
    try:
        connections = node_connections(graph, NodeAddress(detail.name, detail.uri))
    except NodeUnreachableError as error:
        complain("rosnode", error)
        return False
    print(connections_text(graph, connections))
    return True


def _machine(argv: Sequence[str]) -> None:
    parser = Parser(
        "rosnode machine", description="List the machines that nodes run on, or the nodes on one."
    )
    parser.add_argument("machine", nargs="?", help="a machine's name or address")
    options = parser.parse_args(argv)
    with Graph.open("rosnode") as graph:
        found = nodes_on(graph, options.machine) if options.machine else sorted({*node_hosts(graph).values()})
        print("\n".join(found))


def _kill(argv: Sequence[str]) -> int:
    parser = Parser("rosnode kill", description="Ask nodes to shut down; without a name, choose from a list.")
    parser.add_argument("nodes", nargs="*", metavar="node", help="names of nodes")
    parser.add_argument("-a", "--all", action="store_true", help="kill all nodes")
    options = parser.parse_args(argv)
    if options.all and options.nodes:
        parser.error("-a kills all nodes: it takes no names")
    with Graph.open("rosnode") as graph:
        if options.all:
            nodes = graph.addresses(list_nodes(graph))
        elif options.nodes:
            nodes = _known(graph, [graph.resolve(name) for name in options.nodes])
            if len(nodes) < len(options.nodes):
                return 1
        else:
            nodes = [find_node(graph, _chosen(list_nodes(graph)))]
        if not nodes:
            raise NotFoundError("node", "any", hint="there is none to kill")
        if len(nodes) == 1:
            print(f"killing {nodes[0].name}")
        else:
            print("killing:\n" + "\n".join(f" * {node.name}" for node in nodes))
        sys.stdout.flush()
        hung = 0
        for node in nodes:
            try:
                kill_node(graph, node)
            except NodeUnreachableError as error:
                complain("rosnode", error)
                hung += 1
        if hung < len(nodes):
            print("killed")
        return 1 if hung else 0


def _known(graph: Graph, names: list[str]) -> list[NodeAddress]:
    """The nodes of ``names`` that there are; of each other one it is said that it is not."""
    found = []
    for name in names:
        try:
            found.append(find_node(graph, name))
        except NotFoundError as error:
            complain("rosnode", error)
    return found


def _chosen(nodes: list[str]) -> str:
    if not nodes:
        raise NotFoundError("node", "any", hint="there is none to kill")
    print("\n".join(f"{number}. {node}" for number, node in enumerate(nodes, 1)))
    print("\nPlease enter the number of the node you wish to kill.")
    while True:
        print("> ", end="", flush=True)
        line = sys.stdin.readline()
        if not line:
            raise UsageError("no node was chosen")
        if line.strip().isdecimal() and 1 <= int(line) <= len(nodes):
            return nodes[int(line) - 1]
        print(f"ERROR: please enter a number from 1 to {len(nodes)} (ctrl-C to cancel)")


def _cleanup(argv: Sequence[str]) -> int:
    parser = Parser(
        "rosnode cleanup", description="Take nodes that do not answer out of the master, after a question."
    )
    parser.parse_args(argv)
    with Graph.open("rosnode") as graph:
        silent = unreachable_nodes(graph)
        if not silent:
            return 0
        print("Unable to contact the following nodes:\n" + "\n".join(f" * {node.name}" for node in silent))
        print("Warning: these might include alive and functioning nodes, e.g. in unstable networks.")
        print("Cleanup will purge all information about these nodes from the master.")
        while True:
            print("Please type y or n to continue:", flush=True)
            answer = sys.stdin.readline().strip()
            if answer in ("", "n"):
                print("aborting")
                return 0
            if answer == "y":
                break
        for node in silent:
            print(f"Unregistering {node.name}")
            forget_node(graph, node)
        print("done")
        return 0


_FAMILY = Family(
    "rosnode",
    "rosnode is a command-line tool for printing information about ROS Nodes.",
    (
        Verb("ping", "test connectivity to node", _ping),
        Verb("list", "list active nodes", _list),
        Verb("info", "print information about node", _info),
        Verb("machine", "list nodes running on a particular machine or list machines", _machine),
        Verb("kill", "kill a running node", _kill),
        Verb("cleanup", "purge registration information of unreachable nodes", _cleanup),
    ),
    "Type rosnode <command> -h for more detailed usage, e.g. 'rosnode ping -h'",
)
