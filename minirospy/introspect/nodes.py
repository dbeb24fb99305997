"""Nodes: list them, their topics, services and connections; ping and stop them.

Source: http://wiki.ros.org/rosnode, http://wiki.ros.org/ROS/Slave_API.
"""

from __future__ import annotations

import contextlib
import socket
import time
from typing import TYPE_CHECKING, NamedTuple

from minirospy.base.errors import (
    SUSPENDED,
    NodeUnreachableError,
    NotFoundError,
    RpcError,
    RpcProtocolError,
    RpcRefused,
    RpcTimeout,
    RpcUnreachable,
)
from minirospy.introspect.graph import Graph, NodeAddress, in_namespace, node_host
from minirospy.introspect.topics import UNKNOWN_TYPE
from minirospy.runtime.rpc.master_proxy import SlaveProxy

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

    from minirospy.runtime.rpc.master_proxy import BusConnection, MasterProxy, SystemState

__all__ = [
    "Connections",
    "Neighbours",
    "NodeDetail",
    "TypedName",
    "find_node",
    "forget_node",
    "has_exited",
    "is_known_host",
    "is_timeout",
    "is_unknown_host",
    "kill_node",
    "list_nodes",
    "neighbours",
    "node_connections",
    "node_detail",
    "node_hosts",
    "nodes_on",
    "ping_node",
    "unreachable_nodes",
]


SHUTDOWN_SECONDS = 10.0
"""Timeout in seconds, long enough for a node to run its shutdown hooks before it responds."""


class TypedName(NamedTuple):
    """A topic's name and type."""

    name: str
    type: str


class NodeDetail(NamedTuple):
    """The registrations of a node at the master."""

    name: str
    uri: str | None
    publications: list[TypedName]
    subscriptions: list[TypedName]
    services: list[str]


class Connections(NamedTuple):
    """The connections that a node reports: its process ID and its links."""

    pid: int
    links: list[BusConnection]


class Neighbours(NamedTuple):
    """The nodes that a node receives messages from and sends messages to, according to the master."""

    senders: list[str]
    receivers: list[str]


def list_nodes(graph: Graph, namespace: str = "/") -> list[str]:
    """Return the sorted names of the nodes at or below ``namespace``."""
    state = graph.state()
    found: set[str] = set()
    for table in (state.publishers, state.subscribers, state.services):
        for nodes in table.values():
            found.update(nodes)
    return sorted(node for node in found if in_namespace(node, namespace))


def node_hosts(graph: Graph) -> dict[str, str]:
    """Return the host name or address of each node whose URI the master knows, as a dict keyed by node."""
    hosts = {node.name: node_host(node.uri) for node in graph.addresses(list_nodes(graph))}
    return {node: host for node, host in hosts.items() if host}


def nodes_on(graph: Graph, machine: str) -> list[str]:
    """Return the nodes on a machine, given by its name or address. Raise NotFoundError if there are none."""
    hosts = node_hosts(graph)
    found = [node for node, host in hosts.items() if _is_same_host(host, machine)]
    if not found:
        raise NotFoundError("machine", machine, hosts.values(), "no node runs on it")
    return found


def is_known_host(machine: str) -> bool:
    """Return whether a host name or address resolves to an IPv4 address."""
    return _ipv4_address(machine) is not None


def neighbours(state: SystemState) -> dict[str, Neighbours]:
    """Return a dict from node name to neighbours, sorted by name, with all nodes that publish or subscribe."""
    senders: dict[str, set[str]] = {}
    receivers: dict[str, set[str]] = {}
    for topic in {*state.publishers, *state.subscribers}:
        publishing, subscribing = state.publishers.get(topic, []), state.subscribers.get(topic, [])
        for node in publishing:
            receivers.setdefault(node, set()).update(subscribing)
        for node in subscribing:
            senders.setdefault(node, set()).update(publishing)
    return {
        name: Neighbours(sorted(senders.get(name, ())), sorted(receivers.get(name, ())))
        for name in sorted({*senders, *receivers})
    }


def find_node(graph: Graph, name: str) -> NodeAddress:
    """Return the node ``name`` (a global name) and its URI. Raise NotFoundError, with similar names, if it does not exist."""
    uri = graph.node_uri(name)
    if uri is None:
        raise NotFoundError("node", name, list_nodes(graph))
    return NodeAddress(name, uri)


def node_detail(graph: Graph, name: str) -> NodeDetail:
    """Return what the master knows about the node ``name`` (a global name). Raise NotFoundError if it is not registered."""
    state = graph.state()
    # Use only types that publishers have registered: rosnode prints "unknown type" for a topic without publishers.
    types = dict(graph.master.get_published_topics())

    def topics(table: Mapping[str, list[str]]) -> list[TypedName]:
        mine = sorted(topic for topic, nodes in table.items() if name in nodes)
        return [TypedName(topic, types.get(topic, UNKNOWN_TYPE)) for topic in mine]

    services = sorted(service for service, nodes in state.services.items() if name in nodes)
    publications, subscriptions = topics(state.publishers), topics(state.subscribers)
    uri = graph.node_uri(name)
    if uri is None and not (publications or subscriptions or services):
        raise NotFoundError("node", name, list_nodes(graph))
    return NodeDetail(name, uri, publications, subscriptions, services)


def node_connections(graph: Graph, node: NodeAddress) -> Connections:
    """Ask a node for its process ID and its connections. Raise NodeUnreachableError if it does not respond."""
    with _named(node), contextlib.closing(_slave(graph, node, timeout=5.0)) as slave:
        return Connections(slave.get_pid(), slave.get_bus_info())


def ping_node(graph: Graph, node: NodeAddress, timeout: float = 3.0) -> float:
    """Call a node; return the round-trip time in seconds. Raise NodeUnreachableError if the call fails."""
    with _named(node), contextlib.closing(_slave(graph, node, timeout)) as slave:
        start = time.perf_counter()
        slave.get_pid()
        return time.perf_counter() - start


def kill_node(graph: Graph, node: NodeAddress, reason: str = "user request") -> None:
    """Ask a node to shut down; do nothing if it has already exited.

    Raise NodeUnreachableError if the node does not respond in time.
    """
    with contextlib.closing(_slave(graph, node, SHUTDOWN_SECONDS)) as slave:
        try:
            slave.shutdown(reason)
        except RpcUnreachable as error:
            if isinstance(error.__cause__, TimeoutError):
                raise NodeUnreachableError(node.name, error.uri, error.why) from error
        except RpcError:
            pass  # a node that exits immediately may not send its whole response


def is_unknown_host(error: NodeUnreachableError) -> bool:
    """Return whether a node was unreachable because its host name does not resolve."""
    return isinstance(getattr(error.__cause__, "__cause__", None), socket.gaierror)


def is_timeout(error: NodeUnreachableError) -> bool:
    """Return whether a node was unreachable because it did not respond in time."""
    return isinstance(getattr(error.__cause__, "__cause__", None), TimeoutError)


def unreachable_nodes(
    graph: Graph, timeout: float = 3.0, on_error: Callable[[NodeUnreachableError], object] | None = None
) -> list[NodeAddress]:
    """Return the registered nodes that do not respond; call ``on_error`` with the error for each."""
    found = []
    for node in graph.addresses(list_nodes(graph)):
        if node.uri is None:
            continue
        try:
            ping_node(graph, node, timeout)
        except NodeUnreachableError as error:
            found.append(node)
            if on_error:
                on_error(error)
    return found


def forget_node(graph: Graph, node: NodeAddress, state: SystemState | None = None) -> None:
    """Unregister everything that a node has registered; do not affect a newer node with the same name.

    ``state``: the master's state, if the caller already has it. Raise MasterUnreachableError if no master responds.
    """
    from minirospy.runtime.rpc.master_proxy import MasterProxy

    state = state or graph.state()
    uri = node.uri or ""
    # Use the node's name as caller_id, because the master removes only registrations of the caller.
    master = MasterProxy(graph.master.uri, node.name)
    try:
        # Topics are unregistered by the node's URI, services by the service's own URI.
        # If the node's URI is still the same after looking up the services, they do not belong to a newer node of this name.
        services = {service: _service_uri(master, service) for service in _held_by(state.services, node.name)}
        with contextlib.suppress(RpcRefused):
            if master.lookup_node(node.name) == uri:
                for service, service_uri in services.items():
                    master.unregister_service(service, service_uri)
        for topic in _held_by(state.publishers, node.name):
            master.unregister_publisher(topic, uri)
        for topic in _held_by(state.subscribers, node.name):
            master.unregister_subscriber(topic, uri)
    finally:
        master.close()


def has_exited(graph: Graph, node: NodeAddress, timeout: float = 3.0) -> bool:
    """Return whether the node's process is gone: nothing, or another process, listens at its address.

    Return False for a node that does not respond in time, because it may be alive.
    """
    with contextlib.closing(_slave(graph, node, timeout)) as slave:
        try:
            return bool(slave.call("getName") != node.name)
        except RpcUnreachable as error:
            # EOFError: another server, such as a TCPROS server, uses the port now and has closed the connection.
            return isinstance(error.__cause__, ConnectionError | EOFError)
        except RpcProtocolError:
            return True
        except RpcError:
            # Nodes in roscpp do not implement getName.
            return False


def _service_uri(master: MasterProxy, service: str) -> str:
    try:
        return master.lookup_service(service)
    except RpcRefused:
        return ""


def _is_same_host(one: str, other: str) -> bool:
    if one == other:
        return True
    address = _ipv4_address(one)
    return address is not None and address == _ipv4_address(other)


def _ipv4_address(host: str) -> str | None:
    try:
        return socket.gethostbyname(host)
    except OSError:
        return None


def _held_by(table: Mapping[str, Iterable[str]], node: str) -> list[str]:
    return [name for name, nodes in table.items() if node in nodes]


def _slave(graph: Graph, node: NodeAddress, timeout: float) -> SlaveProxy:
    if node.uri is None:
        raise NodeUnreachableError(node.name, "?", "the master does not know its address")
    return SlaveProxy(node.uri, "/" + graph.tool, timeout)


@contextlib.contextmanager
def _named(node: NodeAddress) -> Iterator[None]:
    """Convert an error of a call to a node to a NodeUnreachableError that includes the node's name."""
    try:
        yield
    except RpcTimeout as error:
        raise NodeUnreachableError(node.name, error.uri, f"{error.why}; {SUSPENDED}") from error
    except RpcUnreachable as error:
        raise NodeUnreachableError(node.name, error.uri, error.why) from error
    except RpcError as error:
        raise NodeUnreachableError(node.name, node.uri or "?", str(error)) from error
