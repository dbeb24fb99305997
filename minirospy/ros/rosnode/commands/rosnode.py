"""rosnode: lists, inspects, pings and kills nodes.

Source: http://wiki.ros.org/rosnode. The output is the same as in ROS.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence

from minirospy.base.errors import MasterUnreachableError, NodeUnreachableError, NotFoundError, UsageError
from minirospy.base.escape import escaped
from minirospy.command.command import RosText, WordedError, complain
from minirospy.command.parser import Misuse, Parser
from minirospy.command.verbs import Family, HelpStatus, Verb
from minirospy.introspect.graph import Graph, NodeAddress, node_host
from minirospy.introspect.nodes import (
    NodeDetail,
    find_node,
    forget_node,
    is_known_host,
    is_timeout,
    is_unknown_host,
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

__all__ = ["FAMILY", "main"]

_PING_SECONDS = 3.0
_RULE = "-" * 80


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status."""
    return FAMILY.main(argv)


def _ping_parser() -> Parser:
    parser = Parser(
        "rosnode ping",
        "Call a node once a second and print how long it takes.",
        "rosnode ping [options] <node>",
        surplus="you may only specify one input node",
    )
    parser.add_argument("node", nargs="?", help="the node's name", completer="nodes")
    parser.add_argument("-a", "--all", action="store_true", help="ping all nodes")
    parser.add_argument(
        "-c",
        dest="count",
        type=int,
        default=0,
        metavar="COUNT",
        help="number of pings to send. Not available with --all",
    )
    return parser


def _ping(node: str | None, all: bool, count: int) -> int:
    if all and node:
        raise Misuse(
            "-a pings all nodes once: it takes neither a name nor -c",
            f"Invalid arguments '{node}' used with --all",
        )
    if all and count:
        raise Misuse(
            "-a pings all nodes once: it takes neither a name nor -c", "-c may not be used with --all"
        )

    if not all and not node:
        raise _no_node_to_ping()
    with Graph.open("rosnode") as graph:
        if not node:
            return _ping_all(graph)
        name = graph.resolve(node)
        print(f"rosnode: node is [{name}]", flush=True)
        try:
            return _ping_one(graph, find_node(graph, name), count)
        except NodeUnreachableError as error:
            raise WordedError(error, RosText(_no_answer(error), 0)) from error


def _no_node_to_ping() -> Misuse:
    """Return the error for a missing node name, listing the nodes if a master responds."""
    try:
        with Graph.open("rosnode") as graph:
            nodes = list_nodes(graph)
    except MasterUnreachableError:
        return Misuse("please enter a node to ping", "Please enter a node to ping")
    available = "".join(f"\n{name}" for name in nodes)
    # Like ROS, print the error twice: before and after the list of nodes.
    ros = f"Please enter a node to ping. Available nodes are:{available}\n{_ping_parser().usage_line()}\n\n"
    return Misuse(
        f"please enter a node to ping: {' '.join(nodes) or 'there are none'}",
        f"{ros}rosnode: error: Please enter a node to ping",
    )


def _ping_one(graph: Graph, node: NodeAddress, count: int) -> int:
    """Ping a node once a second, ``count`` times or, if ``count`` is 0, until Ctrl-C."""
    print(f"pinging {node.name} with a timeout of {_PING_SECONDS}s", flush=True)
    times: list[float] = []
    try:
        while True:
            _ping_once(graph, node, times)
            if len(times) == count:
                break
            time.sleep(1.0)
    except KeyboardInterrupt:
        pass

    if times and count != 1:
        print(f"ping average: {sum(times) / len(times):f}ms")
    return 0


def _ping_all(graph: Graph) -> int:
    nodes = graph.addresses(list_nodes(graph))
    print("Will ping the following nodes: \n" + "".join(f" * {node.name}\n" for node in nodes))
    for node in nodes:
        print(f"pinging {node.name} with a timeout of {_PING_SECONDS}s", flush=True)
        try:
            _ping_once(graph, node, [])
        except NodeUnreachableError as error:
            complain("rosnode", error, ros_text=_no_answer(error))
    return 0


def _no_answer(error: NodeUnreachableError) -> str:
    """Return ROS's error message for a node that does not respond."""
    if is_unknown_host(error):
        return f"ERROR: Unknown host [{node_host(error.uri)}] for node [{error.name}]"
    if is_timeout(error):
        return f"connection to [{error.name}] timed out"
    return f"ERROR: connection refused to [{error.uri}]"


def _ping_once(graph: Graph, node: NodeAddress, times: list[float]) -> None:
    """Ping a node and print the time in ms. Before, append the time to ``times``, because Ctrl-C may interrupt the print."""
    times.append(ping_node(graph, node, _PING_SECONDS) * 1000.0)
    print(f"xmlrpc reply from {node.uri}\ttime={times[-1]:f}ms", flush=True)


def _list_parser() -> Parser:
    parser = Parser(
        "rosnode list",
        "List the nodes, or those in a namespace.",
        "rosnode list",
        surplus="invalid args: you may only specify one namespace",
    )
    parser.add_argument("namespace", nargs="?", help="only nodes at or below this name", completer="nodes")
    parser.add_argument("-u", dest="uris", action="store_true", help="list XML-RPC URIs")
    parser.add_argument("-a", "--all", action="store_true", help="list all information")
    return parser


def _list(namespace: str | None, uris: bool, all: bool) -> None:
    with Graph.open("rosnode") as graph:
        nodes = list_nodes(graph, graph.resolve(namespace) if namespace else "/")
        if all:
            lines = [f"{node.uri or 'unknown address'} \t{node.name}" for node in graph.addresses(nodes)]
        elif uris:
            lines = [node.uri or "unknown address" for node in graph.addresses(nodes)]
        else:
            lines = nodes
        print("\n".join(lines))


def _info_parser() -> Parser:
    parser = Parser(
        "rosnode info",
        "Print what nodes publish, subscribe to, serve, and their connections.",
        "rosnode info [options] node1 [node2...]",
        missing="You must specify at least one node name",
    )
    _add_nodes(parser, "+")
    parser.add_argument(
        "-q",
        "--quiet",
        action="store_true",
        help="Prints only basic information such as pubs/subs and does not contact nodes for more information",
    )
    return parser


def _info(nodes: Sequence[str], quiet: bool) -> int:
    failed = 0
    with Graph.open("rosnode") as graph:
        for name in nodes:
            print(_RULE, flush=True)
            try:
                detail = node_detail(graph, graph.resolve(name))
            except NotFoundError as error:
                print(node_text(NodeDetail(error.name, None, [], [], [])))
                complain("rosnode", error, ros_text=f"cannot contact [{error.name}]: unknown node")
                continue

            print(node_text(detail))
            if not quiet:
                failed += not _print_connections(graph, detail)
    return 1 if failed else 0


def _print_connections(graph: Graph, detail: NodeDetail) -> bool:
    print(f"\ncontacting node {detail.uri} ...", flush=True)
    try:
        connections = node_connections(graph, NodeAddress(detail.name, detail.uri))
    except NodeUnreachableError as error:
        complain("rosnode", error, ros_text=f"ERROR: Communication with node[{error.uri}] failed!")
        return False
    print(connections_text(graph, connections))
    return True


_NO_ADDRESS = "ERROR: cannot resolve machine name [{name}] to address"


def _machine_parser() -> Parser:
    parser = Parser(
        "rosnode machine",
        "List the machines that nodes run on, or the nodes on one.",
        "rosnode machine [machine-name]",
        surplus="please enter only one machine name",
    )
    parser.add_argument("machine", nargs="?", help="a machine's name or address", completer="machines")
    return parser


def _machine(machine: str | None) -> None:
    with Graph.open("rosnode") as graph:
        try:
            found = nodes_on(graph, machine) if machine else sorted({*node_hosts(graph).values()})
        except MasterUnreachableError as error:
            # ROS resolves the machine's address before calling the master.
            if machine and not is_known_host(machine):
                raise WordedError(error, RosText(_NO_ADDRESS.format(name=machine))) from error
            raise
        print("\n".join(found))


def _kill_parser() -> Parser:
    parser = Parser(
        "rosnode kill",
        "Request nodes to shut down; without a name, choose from a list.",
        "rosnode kill [node]...",
    )
    _add_nodes(parser, "*")
    parser.add_argument("-a", "--all", action="store_true", help="kill all nodes")
    return parser


def _kill(nodes: Sequence[str], all: bool) -> int:
    if all and nodes:
        raise Misuse("-a kills all nodes: it takes no names", "invalid arguments with kill all (-a) option")

    with Graph.open("rosnode") as graph:
        if all:
            chosen = graph.addresses(list_nodes(graph))
        elif nodes:
            chosen = _known(graph, [graph.resolve(name) for name in nodes])
            if len(chosen) < len(nodes):
                return 1
        else:
            chosen = [find_node(graph, _chosen(list_nodes(graph)))]
        return _kill_all(graph, chosen)


def _kill_all(graph: Graph, nodes: Sequence[NodeAddress]) -> int:
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
    """Return the ``names`` that are nodes; print an error for each of the others."""
    found: list[NodeAddress] = []
    unknown: list[NotFoundError] = []
    for name in names:
        try:
            found.append(find_node(graph, name))
        except NotFoundError as error:
            unknown.append(error)

    if unknown:
        print(
            "ERROR: Unknown node(s):", *(f" * {error.name}" for error in unknown), sep="\n", file=sys.stderr
        )
    for each in unknown:
        complain("rosnode", each)
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


def _cleanup_parser() -> Parser:
    return Parser(
        "rosnode cleanup",
        "Unregister nodes that do not answer from the master, after confirmation.",
        "rosnode cleanup",
    )


def _cleanup() -> int:
    with Graph.open("rosnode") as graph:
        silent = unreachable_nodes(
            graph, on_error=lambda error: print(escaped(_no_answer(error)), file=sys.stderr)
        )
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


def _add_nodes(parser: Parser, nargs: str) -> None:
    parser.add_argument(
        "nodes", nargs=nargs, default=[], metavar="node", help="names of nodes", completer="nodes"
    )


FAMILY = Family(
    "rosnode",
    "rosnode is a command-line tool for printing information about ROS Nodes.",
    (
        Verb(
            "ping",
            "test connectivity to node",
            _ping_parser,
            _ping,
            {"node": RosText("cannot ping [{name}]: unknown node", 0)},
        ),
        Verb("list", "list active nodes", _list_parser, _list),
        Verb("info", "print information about node", _info_parser, _info),
        Verb(
            "machine",
            "list nodes running on a particular machine or list machines",
            _machine_parser,
            _machine,
            {"machine": RosText(_NO_ADDRESS)},
        ),
        Verb("kill", "kill a running node", _kill_parser, _kill),
        Verb("cleanup", "purge registration information of unreachable nodes", _cleanup_parser, _cleanup),
    ),
    "Type rosnode <command> -h for more detailed usage, e.g. 'rosnode ping -h'",
    help_status=HelpStatus(none=64, short=64, long=0, unknown=64),
    shows_help_on_error=True,
)
