"""The types of topics: of registered topics and, as in rosmaster, of some that are no longer registered.

Pure. The memory for a type in use counts towards the share of one of the nodes that register its topic.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from sys import intern
from typing import NamedTuple

from minirospy.core.graph.registry_limits import text_cost

__all__ = ["TopicTypes"]

MAX_OLD = 10_000  # maximum number of unregistered topics whose types are kept
_MAX_OLD_BYTES = 4 * 1024 * 1024  # maximum total bytes of unregistered topics' types in memory

_TYPE_BYTES = 100  # approximate bytes for a type without its string


class _Type(NamedTuple):
    text: str
    node: str  # the node to which the type is charged; "" if no node has registered the topic


class TopicTypes:
    """A table from topic to type, also for the topics unregistered last, in the order of the first registrations.

    ``count`` is called with a node and the bytes added to its share, or removed from it if negative.
    """

    def __init__(self, count: Callable[[str, int], object]) -> None:
        self._count = count
        self._types: dict[str, _Type] = {}
        # The unregistered topics, most recent last, and the bytes that their types use.
        self._old: dict[str, None] = {}
        self._old_bytes = 0

    def __contains__(self, topic: str) -> bool:
        return topic in self._types

    def __getitem__(self, topic: str) -> str:
        return self._types[topic].text

    def is_counted_for(self, topic: str, node: str) -> bool:
        """Return whether a topic's type is charged to this node."""
        type_ = self._types.get(topic)
        return type_ is not None and type_.node == node

    def rows(self) -> Iterator[tuple[str, str]]:
        """Yield each topic and its type. The table may change during the iteration."""
        return iter([(topic, type_.text) for topic, type_ in self._types.items()])

    def cost(self, topic: str, type_: str) -> int:
        """Return the additional bytes to charge to a node if it registers the topic with this type."""
        before = self._types.get(topic)
        if before and before.node:
            return max(0, text_cost(type_) - text_cost(before.text))
        return _size_of(max(type_, before.text if before else "", key=len))

    def set(self, topic: str, type_: str, node: str) -> None:
        """Set the type of a topic that ``node`` registers."""
        before = self._types.get(topic)
        if before and before.node:
            if before.text == type_:
                return
            self._count(before.node, -_size_of(before.text))
        elif before:
            self._remove_old(topic, before.text)
        self._types[intern(topic)] = _Type(intern(type_), node)
        self._count(node, _size_of(type_))

    def add(self, topic: str, type_: str, node: str) -> None:
        """Set a topic's type, unless it has one. Charge the type to ``node``, unless another node is charged."""
        before = self._types.get(topic)
        if not (before and before.node):
            self.set(topic, before.text if before else type_, node)

    def keep(self, topic: str, type_: str) -> None:
        """Keep the type of a topic that is not registered, as if the topic had just been unregistered."""
        before = self._types.get(topic)
        if before and before.node:
            return
        if before:
            self._remove_old(topic, before.text)
        self._add_old(topic, intern(type_))

    def _add_old(self, topic: str, type_: str) -> None:
        self._types[topic] = _Type(type_, "")
        self._old[topic] = None
        self._old_bytes += text_cost(topic) + _size_of(type_)

        while len(self._old) > MAX_OLD or self._old_bytes > _MAX_OLD_BYTES:
            oldest = next(iter(self._old))
            self._remove_old(oldest, self._types.pop(oldest).text)

    def leave(self, topic: str, node: str, others: Iterable[str]) -> None:
        """Charge a topic's type to one of the ``others`` that register the topic, after ``node`` has unregistered it."""
        heir = next(iter(others), "")
        if heir == node or not self.is_counted_for(topic, node):
            return

        text = self._types[topic].text
        self._count(node, -_size_of(text))
        if heir:
            self._types[topic] = _Type(text, heir)
            self._count(heir, _size_of(text))
        else:
            self._add_old(topic, text)

    def _remove_old(self, topic: str, type_: str) -> None:
        if topic in self._old:
            del self._old[topic]
            self._old_bytes -= text_cost(topic) + _size_of(type_)


def _size_of(type_: str) -> int:
    return _TYPE_BYTES + text_cost(type_)
