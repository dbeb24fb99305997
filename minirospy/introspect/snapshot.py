"""A snapshot of the whole graph, and the difference between two snapshots.

Pure except for :func:`fetch`. Source: http://wiki.ros.org/ROS/Master_API (getSystemState, getTopicTypes).
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

__all__ = ["Changes", "Snapshot", "compare", "fetch", "moved"]

Table = Mapping[str, tuple[str, ...]]

_ANY = "*"


@dataclass(frozen=True)
class Snapshot:
    """The topics and services of a graph with their nodes, in the master's order, and the known topic types."""

    publishers: Table = field(default_factory=dict)
    subscribers: Table = field(default_factory=dict)
    services: Table = field(default_factory=dict)
    types: Mapping[str, str] = field(default_factory=dict)

    @property
    def topics(self) -> set[str]:
        """Return the topics that have publishers or subscribers."""
        return {*self.publishers, *self.subscribers}

    def filtered(self, topic: Callable[[str], bool], service: Callable[[str], bool]) -> Snapshot:
        """Return a copy without the topics and services that the filters reject."""
        return Snapshot(
            {name: nodes for name, nodes in self.publishers.items() if topic(name)},
            {name: nodes for name, nodes in self.subscribers.items() if topic(name)},
            {name: nodes for name, nodes in self.services.items() if service(name)},
            {name: type_ for name, type_ in self.types.items() if topic(name)},
        )


@dataclass(frozen=True)
class Changes:
    """The difference between two snapshots: the complete new or changed entries, and the removed names.

    A topic that has lost its last publisher but still has subscribers is in ``publishers`` with an empty list.
    """

    publishers: Table
    subscribers: Table
    services: Table
    removed_topics: tuple[str, ...]
    removed_services: tuple[str, ...]

    def __bool__(self) -> bool:
        """Return whether there are any changes."""
        return bool(
            self.publishers
            or self.subscribers
            or self.services
            or self.removed_topics
            or self.removed_services
        )


def compare(before: Snapshot, after: Snapshot) -> Changes:
    """Return the differences between two snapshots, except changes of a topic's type."""
    left = before.topics - after.topics
    return Changes(
        _changed(before.publishers, after.publishers, left),
        _changed(before.subscribers, after.subscribers, left),
        _changed(before.services, after.services, before.services.keys() - after.services.keys()),
        tuple(sorted(left)),
        tuple(sorted(before.services.keys() - after.services.keys())),
    )


def moved(before: Table, after: Table) -> list[str]:
    """Return the names that moved to the end of the table: the master moves a name there when it is registered again."""
    found: dict[str, None] = {}
    rest = iter(name for name in before if name in after)
    for name in after:
        if name not in before or name in found:
            continue
        for other in rest:
            if other == name:
                break
            found[other] = None
    return [*found]


async def fetch(call: Callable[..., Awaitable[Any]]) -> Snapshot:
    """Fetch the current graph. ``call(method, *arguments)`` calls the master; its exceptions propagate."""
    state = await call("getSystemState")
    types = await call("getTopicTypes")
    publishers, subscribers, services = (
        {str(name): tuple(map(str, nodes)) for name, nodes in table} for table in state
    )
    known = {str(topic): str(type_) for topic, type_ in types if type_ != _ANY}
    return Snapshot(publishers, subscribers, services, known)


def _changed(before: Table, after: Table, left: set[str]) -> dict[str, tuple[str, ...]]:
    changed = {name: nodes for name, nodes in after.items() if before.get(name) != nodes}
    changed.update((name, ()) for name in before if name not in after and name not in left)
    return changed
