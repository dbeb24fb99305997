"""Topics: list them, and find their types, publishers and subscribers.

Source: http://wiki.ros.org/ROS/Master_API (getSystemState, getTopicTypes).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from minirospy.base.errors import NotFoundError
from minirospy.introspect.graph import Graph, NodeAddress, in_namespace, node_host, unknown_topic

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = [
    "UNKNOWN_TYPE",
    "TopicDetail",
    "TopicField",
    "TopicList",
    "TopicNodes",
    "by_host",
    "find_topic",
    "find_topics_of_type",
    "list_topics",
    "require_topic",
    "topic_detail",
    "topic_field_type",
    "topic_names",
]

UNKNOWN_TYPE = "unknown type"
"""Shown for a topic whose type no node has declared, because all its subscribers accept any type."""

_ANY = "*"


class TopicNodes(NamedTuple):
    """A topic, its type, and either its publishers or its subscribers."""

    name: str
    type: str
    nodes: tuple[str, ...]


class TopicList(NamedTuple):
    """The published topics with their publishers, and the subscribed topics with their subscribers, in the master's order."""

    published: list[TopicNodes]
    subscribed: list[TopicNodes]


class TopicDetail(NamedTuple):
    """A topic, its type, publishers and subscribers."""

    name: str
    type: str
    publishers: list[NodeAddress]
    subscribers: list[NodeAddress]


class TopicField(NamedTuple):
    """A name split into a topic, the topic's type, and the path of a field in its messages."""

    topic: str
    type: str
    path: str


def topic_names(
    graph: Graph, namespace: str = "/", *, published: bool = True, subscribed: bool = True
) -> list[str]:
    """Return the sorted names of the topics at or below ``namespace`` that have publishers or subscribers."""
    state = graph.state()
    found: set[str] = set()
    if published:
        found.update(state.publishers)
    if subscribed:
        found.update(state.subscribers)
    return sorted(name for name in found if in_namespace(name, namespace))


def list_topics(graph: Graph, namespace: str = "/") -> TopicList:
    """Return the topics at or below ``namespace``, with their types and nodes."""
    state = graph.state()
    types = graph.master.get_topic_types()

    def side(table: Mapping[str, list[str]]) -> list[TopicNodes]:
        return [
            TopicNodes(name, _shown_type(types.get(name)), tuple(nodes))
            for name, nodes in table.items()
            if in_namespace(name, namespace)
        ]

    return TopicList(side(state.publishers), side(state.subscribers))


def by_host(graph: Graph, found: TopicList) -> dict[str, TopicList]:
    """Group the topics by the hosts of the nodes that use them; return a dict sorted by host."""
    hosts = {
        node: node_host(graph.node_uri(node)) for side in found for topic in side for node in topic.nodes
    }

    def on(host: str, side: list[TopicNodes]) -> list[TopicNodes]:
        mine = [topic._replace(nodes=tuple(n for n in topic.nodes if hosts[n] == host)) for topic in side]
        return [topic for topic in mine if topic.nodes]

    known = sorted({host for host in hosts.values() if host})
    return {host: TopicList(on(host, found.published), on(host, found.subscribed)) for host in known}


def topic_detail(graph: Graph, topic: str) -> TopicDetail:
    """Return a topic's type, publishers and subscribers. Raise NotFoundError if the topic does not exist."""
    state = graph.state()
    publishers, subscribers = state.publishers.get(topic, []), state.subscribers.get(topic, [])
    if not publishers and not subscribers:
        raise unknown_topic(graph, topic)
    return TopicDetail(
        topic,
        _shown_type(graph.master.get_topic_types().get(topic)),
        graph.addresses(sorted(publishers)),
        graph.addresses(sorted(subscribers)),
    )


def find_topic(graph: Graph, name: str) -> TopicField | None:
    """Return the topic for the global name ``name``, which may include a field: ``/pose/header/stamp``.

    Return None if the topic does not exist, or its type is not known yet. A topic with the whole name takes precedence over
    a field of a topic with a shorter name.
    """
    types = {topic: type_ for topic, type_ in graph.master.get_topic_types().items() if type_ != _ANY}
    if name in types:
        return TopicField(name, types[name], "")
    # `/a/b[0]` may be an element of the field b of /a, but not of the topic /a/b.
    holders = [topic for topic in types if name.startswith(topic + "/")]
    if not holders:
        return None
    topic = max(holders, key=len)
    return TopicField(topic, types[topic], name[len(topic) + 1 :].rstrip("/"))


def find_topics_of_type(graph: Graph, type_: str) -> list[str]:
    """Return the sorted names of the topics with this type."""
    return sorted(topic for topic, of in graph.master.get_topic_types().items() if of == type_)


def topic_field_type(field: TopicField) -> str:
    """Return the type of a field in a topic's messages.

    Raise NotFoundError if the message has no such field, or a type is not installed.
    """
    from minirospy.core.idl.load import message_class
    from minirospy.introspect.fields import field_type

    return field_type(message_class(field.type), field.path)


def require_topic(graph: Graph, name: str) -> TopicField:
    """Return the topic like :func:`find_topic`, but raise NotFoundError instead of returning None.

    Raise NotFoundError if the topic does not exist or its type is not known.
    """
    field = find_topic(graph, name)
    if field:
        return field
    state = graph.state()
    if name in state.publishers or name in state.subscribers:
        raise NotFoundError(
            "type of topic", name, hint="its subscribers take any type, and nobody publishes it"
        )
    raise unknown_topic(graph, name)


def _shown_type(type_: str | None) -> str:
    return UNKNOWN_TYPE if type_ is None or type_ == _ANY else type_
