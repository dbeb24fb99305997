"""The parameter server's tree, and who is to be told of a change.

Pure: calls in, values and updates out. Keys are global names. Source:
http://wiki.ros.org/ROS/Parameter%20Server%20API, and real rosmaster where that is silent.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

from minirospy.names import namespace_of

__all__ = ["ParameterTree", "ParameterUpdate", "check_value"]

_MAX_DEPTH = 56
"""Namespaces and dictionaries inside each other: XML-RPC's 64 levels hold it and the answer around it."""

_MAX_INT = 2**31


class ParameterUpdate(NamedTuple):
    """Tell the node at ``uri`` that ``key`` (which ends in a slash) is ``value``; {} where it was deleted."""

    uri: str
    key: str
    value: Any


@dataclass(frozen=True)
class _Subscriber:
    caller_id: str
    uri: str


class ParameterTree:
    """Parameters in namespaces, as nested dictionaries."""

    def __init__(self) -> None:
        self._root: dict[str, Any] = {}
        self._subscribers: dict[str, dict[_Subscriber, None]] = {}

    def get(self, key: str) -> Any:
        """The value, or the dictionary of a namespace. Raises KeyError."""
        value: Any = self._root
        for name in _split(key):
            if not isinstance(value, dict):
                raise KeyError(key)
            value = value[name]
        return value

    def has(self, key: str) -> bool:
        """Whether a parameter or namespace is set."""
        try:
            self.get(key)
        except KeyError:
            return False
        return True

    def set(self, key: str, value: Any, caller_id: str) -> list[ParameterUpdate]:
        """Set a value; a dictionary replaces the namespace.

        A value in the way of a namespace is replaced by it. Raises ValueError where the root would become
        something else than a dictionary.
        """
        path = _split(key)
        if not path:
            if not isinstance(value, dict):
                raise ValueError("cannot set root of parameter tree to non-dictionary")
            self._root = value
        else:
            table = self._root
            for name in path[:-1]:
                inner = table.get(name)
                if not isinstance(inner, dict):
                    inner = table[name] = {}
                table = inner
            table[path[-1]] = value
        return self._updates(path, value, caller_id)

    def delete(self, key: str) -> list[ParameterUpdate]:
        """Delete a parameter or namespace. Raises KeyError, also for the root."""
        path = _split(key)
        if not path:
            raise KeyError(key)
        table = self.get("/" + "/".join(path[:-1]))
        if not isinstance(table, dict):
            raise KeyError(key)
        del table[path[-1]]
        return self._updates(path, {})

    def search(self, namespace: str, key: str) -> str | None:
        """The name of the nearest parameter ``key``, upwards from ``namespace``.

        Only the first part of ``key`` has to exist, as the API demands: a node may look for a namespace
        whose parameters come later. None where there is none.
        """
        if key.startswith("/"):
            return key if self.has(key) else None
        first = _split(key)[0]
        while True:
            base = namespace.rstrip("/")
            if self.has(f"{base}/{first}"):
                return f"{base}/{key}"
            if not base:
                return None
            namespace = namespace_of(base)

    def names(self) -> list[str]:
        """The names of all parameters, namespaces left out."""
        found: list[str] = []

        def walk(table: dict[str, Any], prefix: str) -> None:
            for name, value in table.items():
                if isinstance(value, dict):
                    walk(value, f"{prefix}{name}/")
                else:
                    found.append(prefix + name)

        walk(self._root, "/")
        return found

    def subscribe(self, key: str, caller_id: str, uri: str) -> Any:
        """Tell the node at ``uri`` of changes at, below or above ``key``; its value now, {} where it is not set."""
        self._subscribers.setdefault(_with_slash(_split(key)), {})[_Subscriber(caller_id, uri)] = None
        return self.get(key) if self.has(key) else {}

    def unsubscribe(self, key: str, caller_id: str, uri: str) -> bool:
        """Tell it no more; whether it was subscribed."""
        subscribers = self._subscribers.get(_with_slash(_split(key)), {})
        if _Subscriber(caller_id, uri) not in subscribers:
            return False
        del subscribers[_Subscriber(caller_id, uri)]
        if not subscribers:
            del self._subscribers[_with_slash(_split(key))]
        return True

    def unsubscribe_node(self, caller_id: str, uri: str) -> None:
        """Forget a node that has gone."""
        gone = _Subscriber(caller_id, uri)
        for key in [key for key, subscribers in self._subscribers.items() if gone in subscribers]:
            del self._subscribers[key][gone]
            if not self._subscribers[key]:
                del self._subscribers[key]

    def subscriptions(self) -> Iterator[tuple[str, str, str]]:
        """(node, URI, key) of each subscription; keys end in a slash."""
        return (
            (s.caller_id, s.uri, key) for key, subscribers in self._subscribers.items() for s in subscribers
        )

    def _updates(self, path: list[str], value: Any, setter: str | None = None) -> list[ParameterUpdate]:
        changed = _with_slash(path)
        updates = []
        for key, subscribers in self._subscribers.items():
            if changed.startswith(key):
                # Who set it knows it.
                updates += [
                    ParameterUpdate(s.uri, changed, value) for s in subscribers if s.caller_id != setter
                ]
            elif key.startswith(changed):
                # Who set the namespace is told too: what it keeps of a parameter inside is out of date.
                inside = self.get(key) if self.has(key) else {}
                updates += [ParameterUpdate(s.uri, key, inside) for s in subscribers]
        return updates


def check_value(key: str, value: Any) -> None:
    """Raise ValueError on a value that no answer could hold: it would make the namespaces above unreadable."""
    _check(value, len(_split(key)))


def _check(value: Any, depth: int) -> None:
    if depth > _MAX_DEPTH:
        raise ValueError(f"a parameter is nested deeper than {_MAX_DEPTH} levels")
    if type(value) is int:
        if not -_MAX_INT <= value < _MAX_INT:
            raise ValueError(f"the integer {value} does not fit XML-RPC's 32 bits")
    elif type(value) is dict:
        for item in value.values():
            _check(item, depth + 1)
    elif type(value) is list:
        for item in value:
            _check(item, depth + 1)


def _split(key: str) -> list[str]:
    return [name for name in key.split("/") if name]


def _with_slash(path: list[str]) -> str:
    return "/" + "".join(f"{name}/" for name in path)
