"""The parameter server's tree, and the nodes to notify of a change.

Pure: calls return values, and the updates to send. Keys are global names. Source:
http://wiki.ros.org/ROS/Parameter%20Server%20API, and rosmaster for details missing there.
"""

from __future__ import annotations

import sys
from bisect import bisect_left, bisect_right, insort
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

from minirospy.base.errors import MinirospyError
from minirospy.base.names import namespace_of
from minirospy.base.steps import SMALL_ITEMS, Steps, finish, is_small
from minirospy.core.graph.shares import Excess, Shares, holder_of

__all__ = ["ParameterTree", "ParameterUpdate", "ParametersFullError", "weigh_in_steps"]

# Maximum nesting of namespaces and dictionaries. Together with a response's own elements, XML-RPC allows 64 levels
_MAX_DEPTH = 56

_MAX_INT = 2**31

_STEP_ITEMS = 1000
# Approximate bytes for a number, an empty list, and a dictionary or one of its entries
_ITEM_BYTES, _LIST_BYTES, _ENTRY_BYTES = 40, 70, 120

MAX_BYTES = 96 * 1024 * 1024  # maximum total bytes of all parameters in memory

# Part of MAX_BYTES reserved for values of at most SMALL bytes
RESERVE, SMALL = 16 * 1024 * 1024, 256 * 1024

# Maximum number of subscriptions to parameters: from all nodes, and from one host and port
MAX_SUBSCRIPTIONS, MAX_OF_ONE = 20_000, 10_000

# Part of MAX_SUBSCRIPTIONS reserved for hosts and ports with at most FEW subscriptions
FEW_RESERVE, FEW = 5_000, 100

_FEW_BYTES, _MANY_BYTES = 50_000, 1_000_000


class ParametersFullError(MinirospyError):
    """A parameter or a subscription would exceed a limit, described by ``limit``."""

    def __init__(self, limit: str) -> None:
        super().__init__(limit)
        self.limit = limit

    def __str__(self) -> str:
        return f"the parameter server is full: {self.limit}"


class ParameterUpdate(NamedTuple):
    """A notification to the node at ``uri`` with the value of ``key``, which ends with a slash, at the time of sending."""

    uri: str
    key: str


@dataclass(frozen=True, slots=True)
class _Subscriber:
    caller_id: str
    uri: str


class ParameterTree:
    """Parameters in namespaces, as nested dictionaries.

    The result of :meth:`get` never changes afterwards, so that it may be serialized in steps while other clients set
    parameters: a dictionary that was returned is copied before it is changed.
    """

    def __init__(self, most: int = MAX_BYTES, reserve: int = RESERVE) -> None:
        self._root: dict[str, object] = {}
        # The ids of the dictionaries not returned to any caller since their creation; only these may be modified in place.
        self._own: set[int] = {id(self._root)}
        self._subscribers: dict[str, dict[_Subscriber, None]] = {}
        # The subscribed keys, sorted so that all keys below a namespace are adjacent.
        self._keys: list[str] = []
        self._shares = Shares(MAX_SUBSCRIPTIONS, MAX_OF_ONE, FEW_RESERVE, FEW)
        # For each node's URI: its keys, each with the number of node names that have subscribed to it.
        self._keys_of: dict[str, dict[str, int]] = {}
        self._most = most
        self._reserve = reserve
        # An upper bound for the memory that all values use.
        self._bytes = 0

    def get(self, key: str) -> object:
        """Return the value, or the dictionary of a namespace. Raise KeyError if it is not set."""
        value = self._find(_split(key))
        if value is _UNSET:
            raise KeyError(key)
        if type(value) is dict:
            self._own.clear()
        return value

    def has(self, key: str) -> bool:
        """Return whether a parameter or namespace is set."""
        return self._find(_split(key)) is not _UNSET

    @property
    def is_small(self) -> bool:
        """Return whether all parameters together use little memory, less than ``_FEW_BYTES``."""
        return self._bytes < _FEW_BYTES

    @property
    def is_large(self) -> bool:
        """Return whether a list of all names would use so much memory that only one such list should be built at a time."""
        return self._bytes > _MANY_BYTES

    def is_small_at(self, key: str, most: int = SMALL_ITEMS) -> bool:
        """Return whether a parameter's or namespace's value is small, or not set; see :func:`is_small`."""
        return is_small(self._find(_split(key)), most)

    def has_room(self, weight: int) -> bool:
        """Return whether there is certainly enough memory left for a value of ``weight`` bytes."""
        return self._bytes + weight <= self._most_for(weight)

    def _most_for(self, weight: int) -> int:
        return self._most if weight <= SMALL else self._most - self._reserve

    def make_room(self, weight: int) -> Steps[None]:
        """Recalculate the memory in use, because the current figure may include values that have been replaced.

        Raise ParametersFullError if there is still too little.
        """
        if not self.has_room(weight):
            before = self._bytes
            counted = yield from weigh_in_steps("/", self.get("/"))
            self._bytes = counted + self._bytes - before
            if not self.has_room(weight):
                raise ParametersFullError(f"no more than {self._most_for(weight) // 1024**2} MiB in memory")

    def set(self, key: str, value: object, caller_id: str, weight: int = 0) -> Iterator[ParameterUpdate]:
        """Set a value, whose size is ``weight`` bytes. A dictionary replaces the whole namespace.

        If ``key`` is below an existing parameter that is not a namespace, a new namespace replaces that parameter. Raise
        ValueError if the root would not be a dictionary.
        """
        path = _split(key)
        if path:
            table = self._enter(path[:-1])
            table[path[-1]] = value
        elif isinstance(value, dict):
            self._root = value
        else:
            raise ValueError("cannot set root of parameter tree to non-dictionary")
        self._bytes += weight + len(key) + _ENTRY_BYTES
        return self._updates(path, caller_id)

    def delete(self, key: str) -> Iterator[ParameterUpdate]:
        """Delete a parameter or namespace. Raise KeyError if it is not set or is the root."""
        path = _split(key)
        if not path or self._find(path) is _UNSET:
            raise KeyError(key)
        del self._enter(path[:-1])[path[-1]]
        return self._updates(path)

    def search(self, namespace: str, key: str) -> str | None:
        """Search for ``key`` from ``namespace`` upwards; return the name of the first match, or None.

        Only the first part of ``key`` must exist, as the API requires: a node may search for a namespace
        whose parameters are set later.
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
        """Return the names of all parameters, but no namespaces."""
        return finish(self.names_in_steps())

    def names_in_steps(self) -> Steps[list[str]]:
        """Return the names of all parameters, in steps because the tree may be large."""
        found: list[str] = []
        left = _STEP_ITEMS
        root = self.get("/")
        assert isinstance(root, dict)
        # The namespaces that contain the current item.
        # Do not use a recursive function: its closure and this list would form a reference cycle.
        # The master's garbage collector, which does not examine old objects, might never free it.
        around: list[tuple[str, Iterator[tuple[str, object]]]] = [("/", iter(root.items()))]

        while around:
            prefix, items = around[-1]
            for name, value in items:
                left -= 1
                if not left:
                    left = _STEP_ITEMS
                    yield None
                if isinstance(value, dict):
                    around.append((f"{prefix}{name}/", iter(value.items())))
                    break
                found.append(prefix + name)
            else:
                around.pop()
        return found

    def subscribe(self, key: str, caller_id: str, uri: str) -> object:
        """Subscribe the node at ``uri`` to changes at, below or above ``key``; return the key's value, {} if it is not set.

        Raise ParametersFullError if there are too many subscriptions.
        """
        full = _with_slash(_split(key))
        subscriber = _Subscriber(caller_id, uri)
        if subscriber not in self._subscribers.get(full, ()):
            self._check_subscription(uri)
            if full not in self._subscribers:
                self._subscribers[full] = {}
                insort(self._keys, full)
            self._subscribers[full][subscriber] = None
            self._shares.add(holder_of(uri), 1)
            keys = self._keys_of.setdefault(uri, {})
            keys[full] = keys.get(full, 0) + 1
        return self.get(key) if self.has(key) else {}

    def unsubscribe(self, key: str, caller_id: str, uri: str) -> bool:
        """Unsubscribe a node from a key; return whether it was subscribed."""
        full = _with_slash(_split(key))
        if _Subscriber(caller_id, uri) not in self._subscribers.get(full, {}):
            return False
        self._drop(full, _Subscriber(caller_id, uri))
        return True

    def unsubscribe_node(self, caller_id: str, uri: str) -> None:
        """Remove all of a node's subscriptions."""
        gone = _Subscriber(caller_id, uri)
        for key in self.subscribed_keys(uri):
            if gone in self._subscribers[key]:
                self._drop(key, gone)

    def count_subscriptions(self) -> int:
        """Return the number of subscriptions."""
        return self._shares.total

    def subscribed_keys(self, uri: str) -> list[str]:
        """Return the keys that the node at ``uri`` has subscribed to; they end in a slash."""
        return list(self._keys_of.get(uri, ()))

    def subscriptions(self) -> Iterator[tuple[str, str, str]]:
        """Yield (node, URI, key) for each subscription; keys end in a slash."""
        return (
            (s.caller_id, s.uri, key) for key, subscribers in self._subscribers.items() for s in subscribers
        )

    def _check_subscription(self, uri: str) -> None:
        match self._shares.excess(holder_of(uri), 1):
            case Excess.ALL:
                raise ParametersFullError(f"no more than {self._shares.most} subscriptions")
            case Excess.ONE:
                raise ParametersFullError(
                    f"no more than {self._shares.largest} subscriptions of one host and port"
                )
            case Excess.LARGE:
                raise ParametersFullError(
                    f"no more than {self._shares.shared} subscriptions of all that have many"
                )

    def _find(self, path: list[str]) -> object:
        value: object = self._root
        for name in path:
            value = value.get(name, _UNSET) if isinstance(value, dict) else _UNSET
            if value is _UNSET:
                break
        return value

    def _enter(self, path: list[str]) -> dict[str, object]:
        """Return a modifiable dictionary at ``path``, creating it if it does not exist."""
        table = self._root = self._owned(self._root)
        for name in path:
            inner = table.get(name)
            owned = self._owned(inner if isinstance(inner, dict) else {})
            table[name] = owned
            table = owned
        return table

    def _owned(self, table: dict[str, object]) -> dict[str, object]:
        if id(table) not in self._own:
            table = dict(table)
            self._own.add(id(table))
        return table

    def _drop(self, key: str, subscriber: _Subscriber) -> None:
        del self._subscribers[key][subscriber]
        self._shares.add(holder_of(subscriber.uri), -1)
        keys = self._keys_of[subscriber.uri]
        keys[key] -= 1
        if not keys[key]:
            del keys[key]
        if not keys:
            del self._keys_of[subscriber.uri]
        if not self._subscribers[key]:
            del self._subscribers[key]
            del self._keys[bisect_left(self._keys, key)]

    def _updates(self, path: list[str], setter: str | None = None) -> Iterator[ParameterUpdate]:
        """Yield, one by one, the updates that a change requires; there may be many."""
        changed = _with_slash(path)
        for length in range(len(path) + 1):
            # Skip the node that set the value, because it knows the value.
            for each in list(self._subscribers.get(_with_slash(path[:length]), ())):
                if each.caller_id != setter:
                    yield ParameterUpdate(each.uri, changed)

        # Also notify the node that set the namespace: its cached values of parameters inside it are outdated.
        at = bisect_right(self._keys, changed)
        while at < len(self._keys) and self._keys[at].startswith(changed):
            key = self._keys[at]
            for each in list(self._subscribers[key]):
                yield ParameterUpdate(each.uri, key)
            # Search for the next key again: the subscriptions may have changed while the caller processed the update.
            at = bisect_right(self._keys, key)


_UNSET = object()


def weigh_in_steps(key: str, value: object) -> Steps[int]:
    """Return approximately how many bytes of memory a value uses.

    Raise ValueError if no response could contain the value, because it would make the namespaces above ``key`` unreadable.
    """
    if not _split(key) and not isinstance(value, dict):
        raise ValueError("cannot set root of parameter tree to non-dictionary")
    # Include the namespaces that contain the value, which may not exist yet.
    weight = sum(sys.getsizeof(name) + 2 * _ENTRY_BYTES for name in _split(key)[:-1])
    left = _STEP_ITEMS
    # One entry per container around the current item: (depth of its items, iterator over its remaining items).
    around: list[tuple[int, Iterator[Any]]] = [(len(_split(key)), iter((value,)))]
    while around:
        depth, items = around[-1]
        for item in items:
            left -= 1
            if not left:
                left = _STEP_ITEMS
                yield None

            kind = type(item)
            if depth > _MAX_DEPTH:
                raise ValueError(f"a parameter is nested deeper than {_MAX_DEPTH} levels")
            if kind is list:
                weight += _LIST_BYTES + 8 * len(item)
                around.append((depth + 1, iter(item)))
                break
            if kind is dict:
                weight += _ENTRY_BYTES * (len(item) + 1)
                around.append((depth + 1, iter(item.values())))
                if len(item) < _STEP_ITEMS:
                    weight += sum(map(sys.getsizeof, item))
                else:
                    weight += yield from _weigh_names(item)
                break
            if kind is int:
                if not -_MAX_INT <= item < _MAX_INT:
                    raise ValueError(f"the integer {item} does not fit XML-RPC's 32 bits")
                weight += _ITEM_BYTES
            else:
                weight += sys.getsizeof(item)
        else:
            around.pop()
    return weight


def _weigh_names(table: dict[str, object]) -> Steps[int]:
    weight = 0
    for number, name in enumerate(table):
        weight += sys.getsizeof(name)
        if number % _STEP_ITEMS == _STEP_ITEMS - 1:
            yield None
    return weight


def _split(key: str) -> list[str]:
    return [name for name in key.split("/") if name]


def _with_slash(path: list[str]) -> str:
    return "/" + "".join(f"{name}/" for name in path)
