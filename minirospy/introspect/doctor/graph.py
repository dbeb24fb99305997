"""Check the graph for nodes and services that do not respond, and for publishers and subscribers that do not connect.

Source: http://wiki.ros.org/roswtf ("Online checks").
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from minirospy.base.errors import MinirospyError, RpcFault, RpcProtocolError, RpcRefused
from minirospy.base.suggestions import nearest
from minirospy.introspect.doctor.findings import Finding, ok, problem, warning
from minirospy.introspect.doctor.reach import (
    CONNECT_SECONDS,
    RESUME,
    Fault,
    MasterLocation,
    Trouble,
    host_port,
    in_parallel,
    is_loopback,
    look_up,
    read_topic,
    trouble_of,
)
from minirospy.introspect.graph import Graph, NodeAddress
from minirospy.runtime.rpc.master_proxy import BusConnection, SlaveProxy, SystemState

__all__ = [
    "Answers",
    "NodeAnswer",
    "ask_nodes",
    "check_connections",
    "check_large_messages",
    "check_nodes",
    "check_services",
    "check_topics",
    "differing_types",
    "node_trouble",
]

_ANY = "*"
_ALL_SECONDS = 20.0
_AGAIN_SECONDS = 0.5
_SHOWN = 5


@dataclass(frozen=True)
class NodeAnswer:
    """A node's responses to the doctor's queries; ``trouble`` is set if the node did not respond.

    ``seconds``: duration of the first call; ``stats``: the result of getBusStats, if the caller requested it.
    """

    node: NodeAddress
    trouble: Trouble | None = None
    publications: Mapping[str, str] = field(default_factory=dict)
    subscriptions: Mapping[str, str] = field(default_factory=dict)
    links: tuple[BusConnection, ...] = ()
    pid: int = 0
    seconds: float = 0.0
    stats: tuple[object, ...] = ()


Answers = dict[str, NodeAnswer]


class _Pair(NamedTuple):
    """A publisher and a subscriber of the same topic."""

    topic: str
    publisher: str
    subscriber: str


def ask_nodes(graph: Graph, state: SystemState, besides: str = "", *, with_stats: bool = False) -> Answers:
    """Query all registered nodes, except ``besides``, in parallel; return their responses."""
    tables = (state.publishers, state.subscribers, state.services)
    names = sorted({node for table in tables for nodes in table.values() for node in nodes} - {besides})
    nodes = graph.addresses(names)
    hosts = sorted({host_port(node.uri or "")[0] for node in nodes} - {""})
    known = dict(zip(hosts, in_parallel(look_up, hosts, _ALL_SECONDS), strict=True))

    def ask(node: NodeAddress) -> NodeAnswer:
        found = known.get(host_port(node.uri or "")[0])
        if isinstance(found, Exception):
            raise found
        return _ask(graph.tool, node, with_stats=with_stats)

    found = in_parallel(ask, nodes, _ALL_SECONDS)
    return {
        node.name: answer if isinstance(answer, NodeAnswer) else NodeAnswer(node, trouble_of(answer))
        for node, answer in zip(nodes, found, strict=True)
    }


def check_nodes(answers: Answers, place: MasterLocation) -> Iterator[Finding]:
    """Yield problems for nodes that do not respond. Nodes on the same machine with the same kind of fault share one finding."""
    groups: dict[tuple[str, Fault], list[NodeAnswer]] = {}
    for answer in answers.values():
        if answer.trouble:
            host = host_port(answer.node.uri or "")[0]
            groups.setdefault((host, answer.trouble.fault), []).append(answer)
    for (host, _), silent in groups.items():
        trouble = silent[0].trouble
        assert trouble
        text, advice = node_trouble(host, trouble, place)
        yield problem("nodes", f"{_names(each.node.name for each in silent)}: {text}", advice)
    if not groups:
        hosts = {host_port(answer.node.uri or "")[0] for answer in answers.values()}
        yield ok(
            "nodes", f"{len(answers)} on {len(hosts)} machine(s), all answer" if answers else "there are none"
        )


def node_trouble(host: str, trouble: Trouble, place: MasterLocation) -> tuple[str, str]:
    """Return (problem, advice) for a node that is registered on ``host`` but does not respond there."""
    if trouble.fault is Fault.NAME:
        return (
            f"are registered as being at '{host}', a name that this machine does not know",
            f"on '{host}' set ROS_IP to its address and start them again, or add '{host}' to the hosts file here",
        )

    if is_loopback(host) and not place.is_local:
        return (
            f"are registered as being at '{host}', by which each machine reaches itself alone",
            "on their machine set ROS_IP to its address and start them again",
        )

    if trouble.fault is Fault.REFUSED:
        return (
            f"nothing listens at their port on '{host}'",
            "if they were killed, `rosnode cleanup` makes the master forget them; if they run, they registered a wrong address: "
            "set ROS_IP on their machine",
        )

    if trouble.fault is Fault.LATE:
        return f"connections to it on '{host}' are accepted, but nothing is answered ({trouble.text})", RESUME
    if trouble.fault is Fault.STRANGER:
        return f"another program answers at their port on '{host}': {trouble.text}", "`rosnode cleanup`"
    if trouble.fault is Fault.OTHER:
        return f"'{host}': {trouble.text}", "`rosnode cleanup` makes the master forget them"
    return (
        f"nothing comes back from '{host}'" if trouble.fault is Fault.SILENT else f"no way leads to '{host}'",
        f"if `ping {host}` fails too: on their machine set ROS_IP to an address that this one reaches (`rosnode cleanup` "
        "if it is off); if not, a firewall is in the way: see MINIROSPY_PORTS",
    )


def check_topics(state: SystemState, answers: Answers) -> Iterator[Finding]:
    """Yield findings for topics whose nodes report different types, and for topics without publishers."""
    differing = differing_types(state, answers)
    for topic, types in differing.items():
        found = "; ".join(f"{type_}: {_names(nodes)}" for type_, nodes in sorted(types.items()))
        yield problem(
            "topics",
            f"{topic} has nodes of different types, which never connect: {found}",
            "use one type, or two names",
        )

    published = {topic for topic, nodes in state.publishers.items() if nodes} - {"/rosout", "/rosout_agg"}
    alone = [
        f"{topic} ({', '.join(sorted(nodes))}{_near(topic, published)})"
        for topic, nodes in sorted(state.subscribers.items())
        if topic != "/rosout" and not state.publishers.get(topic) and not _is_of_action(topic, state)
    ]
    if alone:
        yield warning(
            "topics", f"nobody publishes {_names(alone)}", "start the publisher, or correct the topic's name"
        )

    if not differing and not alone:
        yield ok(
            "topics", f"{len({*state.publishers, *state.subscribers})}, every type the same at both ends"
        )


def differing_types(state: SystemState, answers: Answers) -> dict[str, dict[str, list[str]]]:
    """Return the topics whose nodes report different types, as {topic: {type: nodes}}."""
    found = {topic: _types(topic, answers) for topic in sorted({*state.publishers, *state.subscribers})}
    return {topic: types for topic, types in found.items() if len(types) > 1}


def _near(topic: str, published: set[str]) -> str:
    near = nearest(topic, published)
    return f"; {near[0]} is published" if near else ""


def check_connections(graph: Graph, state: SystemState, answers: Answers) -> Iterator[Finding]:
    """Yield a finding for each publisher-subscriber pair that should be connected but is not."""
    pairs = [
        _Pair(topic, publisher, subscriber)
        for topic, publishers in state.publishers.items()
        for publisher in publishers
        for subscriber in state.subscribers.get(topic, ())
        if publisher != subscriber and publisher in answers and subscriber in answers
    ]
    pairs = [
        pair
        for pair in pairs
        if not (answers[pair.publisher].trouble or answers[pair.subscriber].trouble)
        and len(_types(pair.topic, answers)) < 2
    ]
    missing = [pair for pair in pairs if not _is_connected(pair, answers)]
    if missing:
        # Nodes that have just started may need more time to connect, so check again.
        time.sleep(_AGAIN_SECONDS)
        names = {name for pair in missing for name in pair[1:]}
        again = in_parallel(
            lambda node: _ask(graph.tool, node), [answers[name].node for name in names], CONNECT_SECONDS * 2
        )
        now = {**answers, **{each.node.name: each for each in again if isinstance(each, NodeAnswer)}}
        missing = [pair for pair in missing if not _is_connected(pair, now)]

    ends: dict[tuple[str, str], list[_Pair]] = {}
    for pair in missing:
        ends.setdefault((pair.publisher, pair.subscriber), []).append(pair)

    for (publisher, subscriber), lost in ends.items():
        host = host_port(answers[publisher].node.uri or "")[0]
        yield problem(
            "connections",
            f"{subscriber} does not get {_names(pair.topic for pair in lost)} of {publisher}",
            _definitions_differ(graph, lost[0], answers)
            or f"run `minirospy doctor` on the machine of {subscriber}: it does not reach '{host}', or has another "
            "definition of the type",
        )

    if not missing:
        yield ok("connections", f"{len(pairs)} between publishers and subscribers, all there")


def check_large_messages(answers: Answers) -> Iterator[Finding]:
    """Yield findings that say, for topics with large messages, whether shared memory is used and, if not, why."""
    shared: set[str] = set()
    others: dict[tuple[str, str], list[str]] = {}
    for answer in answers.values():
        for link in answer.links:
            found = link.large_messages
            if found is None:
                continue
            if found.why:
                receivers = others.setdefault((f"{link.topic} of {answer.node.name}", found.why), [])
                receivers.append(link.destination)
            else:
                shared.add(f"{link.topic} of {answer.node.name}")
    if shared:
        yield ok("large messages", f"shared memory: {_names(sorted(shared))}")
    for (topic, why), receivers in sorted(others.items()):
        yield ok("large messages", f"socket: {topic} to {_names(sorted(receivers))}: {why}")


def check_services(graph: Graph, state: SystemState, answers: Answers) -> Iterator[Finding]:
    """Yield a problem for each service that does not respond, except services of nodes already reported."""
    names = [
        name
        for name, nodes in sorted(state.services.items())
        if any(node in answers and not answers[node].trouble for node in nodes)
    ]
    found = in_parallel(lambda name: _probe_service(graph, name), names, _ALL_SECONDS)
    bad = 0

    for name, result in zip(names, found, strict=True):
        if isinstance(result, RpcRefused):
            continue  # the service was unregistered in the meantime
        if isinstance(result, Exception):
            bad += 1
            trouble = trouble_of(result)
            yield problem(
                "services",
                f"{name} of {state.services[name][-1]} does not answer: {trouble.text}",
                "start its node again; if that one runs elsewhere, its port for services is blocked: see MINIROSPY_PORTS",
            )
        elif result:
            bad += 1
            yield problem("services", f"{name}: {result}", "build both machines from the same definition")

    if not bad:
        yield ok("services", f"{len(names)}, all answer")


def _ask(tool: str, node: NodeAddress, *, with_stats: bool = False) -> NodeAnswer:
    if node.uri is None:
        return NodeAnswer(node, Trouble(Fault.OTHER, "the master does not know its address"))
    slave = SlaveProxy(node.uri, "/" + tool, CONNECT_SECONDS, same_host=False)

    with contextlib.closing(slave):
        start = time.perf_counter()
        pid = slave.get_pid()
        seconds = time.perf_counter() - start
        # Some client libraries do not implement getName.
        with contextlib.suppress(RpcFault, RpcRefused, RpcProtocolError):
            name = slave.call("getName")
            if name not in (node.name, "", 0):
                return NodeAnswer(node, Trouble(Fault.STRANGER, f"it is the node {name}"))
        return NodeAnswer(
            node,
            None,
            dict(slave.get_publications()),
            dict(slave.get_subscriptions()),
            tuple(slave.get_bus_info()),
            pid,
            seconds,
            _stats(slave) if with_stats else (),
        )


def _stats(slave: SlaveProxy) -> tuple[object, ...]:
    """Return a node's connection statistics, or () if it does not provide any."""
    try:
        return tuple(slave.get_bus_stats())
    except (RpcFault, RpcRefused, RpcProtocolError):
        return ()


def _types(topic: str, answers: Answers) -> dict[str, list[str]]:
    """Return the types that nodes report for a topic, each with the nodes that report it."""
    types: dict[str, set[str]] = {}
    for name, answer in answers.items():
        for table in (answer.publications, answer.subscriptions):
            type_ = table.get(topic, _ANY)
            if type_ != _ANY:
                types.setdefault(type_, set()).add(name)
    return {type_: sorted(nodes) for type_, nodes in types.items()}


def _is_of_action(topic: str, state: SystemState) -> bool:
    """Return whether a topic is an action server's goal or cancel topic; such a topic often has no publishers."""
    name, _, end = topic.rpartition("/")
    return end in ("goal", "cancel") and f"{name}/status" in state.publishers


def _is_connected(pair: _Pair, answers: Answers) -> bool:
    publisher, subscriber = answers[pair.publisher], answers[pair.subscriber]
    uri = (publisher.node.uri or "").rstrip("/")
    return any(
        link.topic == pair.topic and "o" in link.direction and link.destination == pair.subscriber
        for link in publisher.links
    ) or any(
        link.topic == pair.topic
        and "i" in link.direction
        and (link.destination.rstrip("/") == uri or link.destination == pair.publisher)
        and link.connected
        for link in subscriber.links
    )


def _definitions_differ(graph: Graph, pair: _Pair, answers: Answers) -> str:
    """Return advice if the publisher has a different definition of the type, or "" if it has the same, or none is known."""
    from minirospy.core.idl.load import message_class

    uri = answers[pair.publisher].node.uri or ""
    try:
        header, _ = read_topic(uri, pair.topic, "/" + graph.tool)
        type_ = header.get("type", "")
        if message_class(type_)._md5sum == header.get("md5sum"):
            return ""
    except (MinirospyError, OSError):
        return ""
    return f"{pair.publisher} has another definition of {type_} than this machine: build all sides from the same one"


def _probe_service(graph: Graph, name: str) -> str:
    """Return a description of a problem with a service's type, or "" if there is no problem.

    Raise OSError or WireError if the connection fails, RpcRefused if the service was unregistered.
    """
    from minirospy.core.idl.load import service_class
    from minirospy.runtime.node.service_client import ServiceClient

    uri = graph.master.lookup_service(name)
    look_up(host_port(uri)[0])
    client = ServiceClient(
        uri, name, _ANY, "/" + graph.tool, probe=True, timeout=CONNECT_SECONDS, same_host=False
    )
    client.close()
    type_, md5sum = client.header.get("type", ""), client.header["md5sum"]
    try:
        known = service_class(type_)._md5sum
    except MinirospyError:
        return ""
    return "" if md5sum in (known, _ANY) else f"its node has another definition of {type_} than this machine"


def _names(names: Iterable[str]) -> str:
    """Join the first few names, and append the number of omitted ones."""
    all_ = list(names)
    more = f" and {len(all_) - _SHOWN} more" if len(all_) > _SHOWN else ""
    return ", ".join(all_[:_SHOWN]) + more
