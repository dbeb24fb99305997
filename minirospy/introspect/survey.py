"""The whole graph as its nodes report it: processes, types, connections, and the traffic between two surveys.

Surveys also include the CPU and memory use of local processes.

Traffic is computed from the nodes' own counters (getBusStats), so that measuring a topic needs no subscription.
Source: http://wiki.ros.org/ROS/Slave_API (getBusStats, getBusInfo).
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from minirospy.base.environment import is_own_host
from minirospy.introspect.doctor.graph import Answers, NodeAnswer, ask_nodes, differing_types, node_trouble
from minirospy.introspect.doctor.reach import MasterLocation, host_port, look_up
from minirospy.introspect.graph import Graph
from minirospy.introspect.processes import ProcessLoad, ProcessLoads
from minirospy.runtime.rpc.master_proxy import SystemState

__all__ = ["Edge", "Survey", "describe", "survey", "traffic"]


class Edge(NamedTuple):
    """A connection for a topic, from the sending to the receiving node."""

    sender: str
    topic: str
    receiver: str


class Counts(NamedTuple):
    """The messages and bytes sent over a connection since it was opened."""

    messages: int
    bytes: int


@dataclass(frozen=True)
class Survey:
    """The graph at a point in time, in monotonic seconds.

    ``counts`` is keyed by process, connection and edge; ``loads`` is keyed by node.
    """

    seconds: float
    state: SystemState
    answers: Answers
    place: MasterLocation
    counts: Mapping[tuple[int, object, Edge], Counts] = field(default_factory=dict)
    loads: Mapping[str, ProcessLoad] = field(default_factory=dict)


def survey(graph: Graph, processes: ProcessLoads | None = None) -> Survey:
    """Query the master and all nodes in parallel. If ``processes`` is given, measure the processes' loads, too.

    Raise MasterUnreachableError if no master responds.
    """
    state = graph.state()
    answers = ask_nodes(graph, state, with_stats=True)
    host, port = host_port(graph.master.uri)
    try:
        place = MasterLocation(host, port, look_up(host))
    except OSError:
        place = MasterLocation(host, port, [])
    counts: dict[tuple[int, object, Edge], Counts] = {}
    for answer in answers.values():
        counts.update(connection_counts(answer))
    return Survey(
        time.monotonic(), state, answers, place, counts, _loads(answers, processes) if processes else {}
    )


def traffic(before: Survey | None, after: Survey) -> dict[Edge, tuple[float, float]]:
    """Return the (messages, bytes) per second of each edge that is in both surveys."""
    if before is None or after.seconds <= before.seconds:
        return {}
    span = after.seconds - before.seconds
    found: dict[Edge, tuple[float, float]] = {}
    for key, now in after.counts.items():
        then = before.counts.get(key)
        # roscpp's counters have 32 bits, so skip those that have wrapped around.
        if then is None or now.messages < then.messages or now.bytes < then.bytes:
            continue
        hz, size = found.get(key[2], (0.0, 0.0))
        found[key[2]] = (hz + (now.messages - then.messages) / span, size + (now.bytes - then.bytes) / span)
    return found


def describe(now: Survey, before: Survey | None = None) -> dict[str, object]:
    """Convert a survey to JSON-compatible values: ``nodes``, ``traffic``, ``mismatches``.

    A row in ``traffic`` is [sender, topic, receiver, Hz, bytes/s].
    """
    held: dict[str, list[str]] = {}
    for service, nodes in now.state.services.items():
        for node in nodes:
            held.setdefault(node, []).append(service)
    return {
        "nodes": [
            {
                **_described(answer, now.place),
                **(now.loads[name]._asdict() if name in now.loads else {}),
                "publishes": _topics(now.state.publishers, answer, answer.publications),
                "subscribes": _topics(now.state.subscribers, answer, answer.subscriptions),
                "services": sorted(held.get(name, ())),
            }
            for name, answer in now.answers.items()
        ],
        "traffic": [
            [*edge, round(hz, 2), round(size, 1)] for edge, (hz, size) in traffic(before, now).items()
        ],
        "mismatches": differing_types(now.state, now.answers),
    }


def _described(answer: NodeAnswer, place: MasterLocation) -> dict[str, object]:
    host = host_port(answer.node.uri or "")[0]
    text, advice = node_trouble(host, answer.trouble, place) if answer.trouble else ("", "")
    return {
        "name": answer.node.name,
        "uri": answer.node.uri or "",
        "host": host,
        "pid": answer.pid,
        "milliseconds": round(answer.seconds * 1000, 2),
        "trouble": text,
        "advice": advice,
        "links": [
            [
                link.topic,
                link.direction,
                link.destination,
                link.true_transport,
                bool(link.connected),
                [*link.large_messages] if link.large_messages else None,
            ]
            for link in answer.links
        ],
    }


def _loads(answers: Answers, processes: ProcessLoads) -> dict[str, ProcessLoad]:
    hosts = {host_port(answer.node.uri or "")[0] for answer in answers.values() if answer.pid}
    own = {host for host in hosts if is_own_host(host)}
    pids = {
        name: answer.pid
        for name, answer in answers.items()
        if answer.pid and host_port(answer.node.uri or "")[0] in own
    }
    found = processes.look(pids.values())
    return {name: found[pid] for name, pid in pids.items() if pid in found}


def _topics(
    table: Mapping[str, Iterable[str]], answer: NodeAnswer, types: Mapping[str, str]
) -> list[list[str]]:
    return [[topic, types.get(topic, "")] for topic in sorted(table) if answer.node.name in table[topic]]


def connection_counts(answer: NodeAnswer) -> dict[tuple[int, object, Edge], Counts]:
    """Return a node's counters for each outbound connection. Skip rows that are not in the documented format."""
    receivers = {
        (link.topic, str(link.id)): link.destination for link in answer.links if "o" in link.direction
    }
    found: dict[tuple[int, object, Edge], Counts] = {}
    publications = answer.stats[0] if answer.stats else []
    for row in publications if isinstance(publications, list) else []:
        try:
            topic, *_, connections = row
            for number, size, *more in connections:
                # A row ends with (message count, is connected) in rospy; in roscpp, the size in bytes precedes the message count.
                messages = more[1] if len(more) > 2 else more[0]
                receiver = receivers.get((topic, str(number)))
                if receiver is not None:
                    edge = Edge(answer.node.name, topic, receiver)
                    found[answer.pid, str(number), edge] = Counts(int(messages), int(size))
        except (TypeError, ValueError, LookupError, OverflowError):
            continue
    return found
