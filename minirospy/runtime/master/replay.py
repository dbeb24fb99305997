"""Convert between journal records and the master's state: apply records to a registry and parameters, and write them.

A record is a change: its name and its arguments. ``runtime/master/journal.py`` stores records in a file.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain
from typing import Any

from minirospy.base.steps import finish
from minirospy.core.graph.master_api import Notice, key_of_node
from minirospy.core.graph.parameters import ParameterTree, weigh_in_steps
from minirospy.core.graph.registry import NodeShutdown, Registry
from minirospy.core.wire.journal import unpack

__all__ = ["Replay", "changes_to", "forget_node"]


class Replay:
    """Applies the records of a journal, in order."""

    def __init__(self, registry: Registry, parameters: ParameterTree) -> None:
        self._registry = registry
        self._parameters = parameters
        # The parts read so far of each incomplete large value, keyed by the value's number.
        self._parts: dict[int, list[bytes]] = {}

    def apply(self, what: str, *args: Any) -> None:
        """Apply one change, without repeating the notifications that were sent when it happened.

        Raise TypeError, ValueError, KeyError or MinirospyError if the record is invalid.
        """
        registry, parameters = self._registry, self._parameters
        actions: Iterable[Notice] = ()

        match what, args:
            case "+pub", (node, topic, type_, uri):
                actions = registry.register_publisher(node, topic, type_, uri).actions
            case "+sub", (node, topic, type_, uri):
                actions = registry.register_subscriber(node, topic, type_, uri).actions
            case "+srv", (node, service, service_uri, uri):
                actions = registry.register_service(node, service, service_uri, uri)
            case "+par", (node, key, uri):
                actions = registry.register_parameter(node, key_of_node(key), uri)
                parameters.subscribe(key, node, uri)
            case "-pub", (node, topic, uri):
                registry.unregister_publisher(node, topic, uri)
            case "-sub", (node, topic, uri):
                registry.unregister_subscriber(node, topic, uri)
            case "-srv", (node, service, service_uri):
                registry.unregister_service(node, service, service_uri)
            case "-par", (node, key, uri):
                if parameters.unsubscribe(key, node, uri):
                    registry.unregister_parameter(node, key_of_node(key), uri)
            case "gone", (node, uri):
                forget_node(registry, parameters, node, uri)
            case "type", (topic, type_):
                registry.set_type(topic, type_)
            case "set", (key, value):
                parameters.set(key, value, "", finish(weigh_in_steps(key, value)))
            case "part", (int(number), bytes(data)):
                self._parts.setdefault(number, []).append(data)
            case "put", (key, number):
                value = unpack(b"".join(self._parts.pop(number)))
                parameters.set(key, value, "", finish(weigh_in_steps(key, value)))
            case "del", (key,):
                parameters.delete(key)
            case _:
                raise ValueError(f"{what!r} with {len(args)} arguments is unknown")

        for action in actions:
            if isinstance(action, NodeShutdown):
                parameters.unsubscribe_node(action.name, action.uri)


def changes_to(registry: Registry, parameters: ParameterTree) -> Iterator[list[object]]:
    """Return the changes that lead from an empty state to the current one, preserving the order of every table.

    The state is copied immediately, so it may change while the returned changes are read.
    """
    uris, types = registry.nodes(), registry.topic_types()
    # Each of these calls returns a copy.
    publications, subscriptions = registry.publications(), registry.all_subscriptions()
    offers, subscribed = list(registry.offers()), list(parameters.subscriptions())
    tree = parameters.get("/")
    return chain(
        (["type", topic, type_] for topic, type_ in types.items()),
        (["+pub", node, topic, types[topic], uris[node]] for node, topic in publications),
        (["+sub", node, topic, "*", uris[node]] for node, topic in subscriptions),
        (["+srv", node, name, uri, uris[node]] for node, name, uri in offers),
        (["+par", node, key, uri] for node, uri, key in subscribed),
        (["set", "/", tree],),
    )


def forget_node(registry: Registry, parameters: ParameterTree, name: str, uri: str) -> list[Notice]:
    """Remove everything that the node ``name`` at ``uri`` has registered; return the notifications to send."""
    parameters.unsubscribe_node(name, uri)
    return list(registry.forget(name, uri))
