"""rosmaster.paramserver: the parameter tree.

Keys are global names. A notify task is called with a list of changes, each ([(node, API)], key, value).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from minirospy.base.names import canonicalize
from minirospy.core.graph.parameters import ParameterTree, ParameterUpdate

__all__ = [
    "GLOBALNS",
    "SEP",
    "ParamDictionary",
    "_compute_all_keys",
    "compute_param_updates",
]

GLOBALNS = SEP = "/"

Notify = Callable[[list[tuple[list[tuple[str, str]], str, object]]], object]


class ParamDictionary:
    """Parameters and their subscribers. Ignores ``reg_manager``, rosmaster's node table."""

    def __init__(self, reg_manager: object = None) -> None:
        self._tree = ParameterTree()
        self._nodes: dict[str, str] = {}

    def get_param_names(self) -> list[str]:
        """Return the names of all parameters."""
        return self._tree.names()

    def search_param(self, ns: str, key: str) -> str | None:
        """Search for a parameter in a namespace and its parents; return the closest match.

        Raise ValueError if the key is empty or private, or the namespace is not global.
        """
        if not key or key[0] == "~":
            raise ValueError("invalid key")
        if not ns or ns[0] != "/":
            raise ValueError("namespace must be global")
        return self._tree.search(ns, key)

    def get_param(self, key: str) -> object:
        """Return a parameter's value, or a namespace as a dictionary. Raise KeyError if it does not exist."""
        return self._tree.get(key)

    def has_param(self, key: str) -> bool:
        """Return whether a parameter or a namespace is set."""
        return self._tree.has(key)

    def set_param(
        self, key: str, value: object, notify_task: Notify | None = None, caller_id: str | None = None
    ) -> None:
        """Set a value; a dictionary replaces a namespace. Raise TypeError if the root is set to a non-dictionary."""
        if key == "/" and not isinstance(value, dict):
            raise TypeError("cannot set root of parameter tree to non-dictionary")
        self._notify(self._tree.set(key, value, caller_id or ""), notify_task)

    def delete_param(self, key: str, notify_task: Notify | None = None) -> None:
        """Delete a parameter or a namespace. Raise KeyError if it does not exist."""
        if key == "/":
            raise KeyError("cannot delete root of parameter tree")
        self._notify(self._tree.delete(key), notify_task)

    def subscribe_param(self, key: str, registration_args: tuple[str, str]) -> object:
        """Subscribe (node, API) to a parameter; return its value, or {} if it is not set."""
        caller_id, uri = registration_args
        self._nodes[uri] = caller_id
        return self._tree.subscribe(key, caller_id, uri)

    def unsubscribe_param(self, key: str, unregistration_args: tuple[str, str]) -> tuple[int, str, int]:
        """Unsubscribe (node, API) from a parameter; return the Master API's response."""
        caller_id, uri = unregistration_args
        shown = key if key.endswith("/") else f"{key}/"
        if self._tree.unsubscribe(key, caller_id, uri):
            return 1, f"Unregistered [{caller_id}] as provider of [{shown}]", 1
        return 1, f"[{caller_id}] is not a known provider of [{shown}]", 0

    def _notify(self, changes: Iterable[ParameterUpdate], notify_task: Notify | None) -> None:
        found = [
            (
                [(self._nodes.get(each.uri, ""), each.uri)],
                each.key,
                self._tree.get(each.key) if self._tree.has(each.key) else {},
            )
            for each in changes
        ]
        if found and notify_task:
            notify_task(found)


def compute_param_updates(
    subscribers: Any, param_key: str, param_value: object, caller_id_to_ignore: str | None = None
) -> list[tuple[list[tuple[str, str]], str, object]]:
    """Return ([(node, API)], key, value) for each subscribed key affected by setting ``param_key``.

    ``subscribers`` maps each subscribed key to [(node, API)]. It is a dictionary, or a table with ``iterkeys()`` as in
    rosmaster.
    """
    if not subscribers:
        return []
    if param_key != SEP:
        param_key = canonicalize(param_key) + SEP
    keys = _compute_all_keys(param_key, param_value) if isinstance(param_value, dict) else None
    updates: list[tuple[list[tuple[str, str]], str, object]] = []
    for subscribed in subscribers.iterkeys() if hasattr(subscribers, "iterkeys") else subscribers:
        namespace = subscribed if subscribed.endswith(SEP) else subscribed + SEP
        if param_key.startswith(namespace):
            nodes = [each for each in subscribers[subscribed] if each[0] != caller_id_to_ignore]
            updates.append((nodes, param_key, param_value))
        elif keys is not None and namespace.startswith(param_key) and subscribed not in keys:
            updates.append((subscribers[subscribed], subscribed, {}))  # the parameter was deleted
    for key in keys or ():
        if key in subscribers:
            value: Any = param_value
            for name in filter(None, key[len(param_key) :].split(SEP)):
                value = value[name]
            updates.append((subscribers[key], key, value))
    return updates


def _compute_all_keys(
    param_key: str, param_value: dict[str, Any], all_keys: list[str] | None = None
) -> list[str]:
    """Return the keys (with trailing slashes) of all values and namespaces in a dictionary set at ``param_key``."""
    found = [] if all_keys is None else all_keys
    for name, value in param_value.items():
        key = f"{param_key.rstrip(SEP)}{SEP}{name}{SEP}"
        found.append(key)
        if isinstance(value, dict):
            _compute_all_keys(key, value, found)
    return found
