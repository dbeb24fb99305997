"""Parameters for clients of the Foxglove protocol: read and set them, and report changes."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Iterable
from typing import Protocol

from minirospy.base.errors import MasterUnreachableError, RpcError, RpcRefused
from minirospy.web.foxglove.protocol import Parameter
from minirospy.web.graph import SharedGraph

__all__ = ["ParameterListener", "Parameters"]

_ROOT = "/"


class ParameterListener(Protocol):
    """A client that can subscribe to parameters."""

    def parameters_changed(self, changed: list[Parameter]) -> None: ...


class Parameters:
    """Reads, writes and watches the graph's parameters. All clients share one subscription to the root namespace."""

    def __init__(self, graph: SharedGraph) -> None:
        self._graph = graph
        self._wanted: dict[ParameterListener, set[str] | None] = {}
        """The parameter names that each client subscribes to; None means all."""
        self._is_watching = False
        self._at_master = asyncio.Lock()

    async def read(self, names: tuple[str, ...]) -> list[Parameter]:
        """Return the named parameters, or all if ``names`` is empty.

        Raise MasterUnreachableError or RpcError if the master's call fails.
        """
        master = self._graph.node.call_master
        allowed = self._graph.filters.parameters
        if not names:
            tree = await master("getParam", _ROOT)
            leaves = _leaves("", tree) if isinstance(tree, dict) else []
            return [Parameter(name, value) for name, value in leaves if allowed(name)]

        found = []
        for name in names:
            try:
                if not allowed(name):
                    raise RpcRefused("getParam", -1, "not allowed")
                found.append(Parameter(name, await master("getParam", self._graph.node.resolve(name))))
            except RpcRefused:
                found.append(Parameter(name, is_set=False))
        return found

    async def write(self, parameters: Iterable[Parameter]) -> list[str]:
        """Set or delete parameters; return an error line for each failure."""
        master = self._graph.node.call_master
        failed = []
        for parameter in parameters:
            name = self._graph.node.resolve(parameter.name)
            if not self._graph.filters.parameters(name):
                failed.append(f"parameter [{name}] may not be set by clients")
                continue
            try:
                if parameter.is_set:
                    await master("setParam", name, parameter.value)
                else:
                    await master("deleteParam", name)
            except (RpcError, MasterUnreachableError, TypeError, ValueError, OverflowError) as error:
                failed.append(f"Failed to set parameter '{name}': {error}")
        return failed

    def subscribe(self, listener: ParameterListener, names: tuple[str, ...]) -> None:
        """Notify ``listener`` of changes of these parameters, or of all parameters if ``names`` is empty."""
        before = self._wanted.get(listener, set())
        self._wanted[listener] = None if not names or before is None else before | set(names)
        if not self._is_watching:
            self._is_watching = True
            self._graph.node.parameters.listeners.append(self._changed)
            self._graph.spawn(self._in_order(self._graph.node.parameters.add))

    def count(self, listener: ParameterListener) -> int:
        """Return the number of parameters to which a client subscribes by name."""
        return len(self._wanted.get(listener) or ())

    def unsubscribe(self, listener: ParameterListener, names: tuple[str, ...]) -> None:
        """Stop notifying ``listener`` of changes of these parameters, or of any if it subscribes to all or ``names`` is empty."""
        before = self._wanted.get(listener, set())
        rest = set() if not names or before is None else before - set(names)
        if rest:
            self._wanted[listener] = rest
        else:
            self.forget(listener)

    def forget(self, listener: ParameterListener) -> None:
        """Cancel all subscriptions of a client."""
        self._wanted.pop(listener, None)
        if not self._wanted and self._is_watching:
            self._is_watching = False
            self._graph.node.parameters.listeners.remove(self._changed)
            self._graph.spawn(self._in_order(self._graph.node.parameters.remove))

    async def _in_order(self, request: Callable[[str], Awaitable[object]]) -> None:
        """Subscribe or unsubscribe at the master with ``request``, after all earlier requests.

        Otherwise requests could overtake each other, because each may use its own connection.
        """
        async with self._at_master:
            await request(_ROOT)

    def _changed(self, name: str, value: object) -> None:
        """Report a change of a parameter or namespace. A ``value`` of ``{}`` means that it was deleted or is empty."""
        allowed = self._graph.filters.parameters
        is_empty = value == {}
        leaves = [] if is_empty else [leaf for leaf in _leaves(name.rstrip("/"), value) if allowed(leaf[0])]
        # Query the master, because its notification does not distinguish a deleted namespace from an empty one.
        emptied = name if is_empty and name != _ROOT and allowed(name) else ""
        again = {emptied} - {""}
        for listener, names in list(self._wanted.items()):
            mine = [Parameter(*leaf) for leaf in leaves if names is None or leaf[0] in names]
            if mine:
                listener.parameters_changed(mine)
            again |= {each for each in names or () if allowed(each) and _is_affected(each, name, value)}
        if again:
            self._graph.spawn(self._report(tuple(again), emptied))

    async def _report(self, names: tuple[str, ...], emptied: str) -> None:
        """Read parameters; send them to their subscribers. Clients that subscribe to all parameters get only ``emptied``."""
        found = await self.read(names)
        for listener, wanted in list(self._wanted.items()):
            mine = [each for each in found if each.name in (wanted or (emptied,))]
            if mine:
                listener.parameters_changed(mine)


def _is_affected(wanted: str, name: str, value: object) -> bool:
    """Return whether ``wanted`` must be read again, because setting ``name`` to ``value`` may have changed it."""
    if name.startswith(wanted.rstrip("/") + "/"):
        return True
    if not isinstance(value, dict):
        return False
    return wanted == name or (value == {} and wanted.startswith(name.rstrip("/") + "/"))


def _leaves(namespace: str, value: object) -> Iterable[tuple[str, object]]:
    if isinstance(value, dict) and value:
        for key, each in value.items():
            yield from _leaves(f"{namespace}/{key}", each)
    elif namespace:
        yield namespace, value
