"""Subscriptions to parameters, whose changes the master reports."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable
from typing import TYPE_CHECKING

from minirospy.base.errors import MasterUnreachableError, RpcError

if TYPE_CHECKING:
    from minirospy.aio.node import Node

__all__ = ["ParameterWatch"]


class ParameterWatch:
    """A node's parameter subscriptions. When a value changes, ``listeners`` are called with (name, value), on the loop.

    A deleted parameter has the value ``{}``, as the master sends it. After a restart of the master, the subscriptions
    are renewed. Source: http://wiki.ros.org/ROS/Parameter%20Server%20API (subscribeParam).
    """

    def __init__(self, node: Node, loop: asyncio.AbstractEventLoop) -> None:
        self.listeners: list[Callable[[str, object], object]] = []
        self._node = node
        self._loop = loop

    async def add(self, name: str) -> object:
        """Subscribe to the parameter with the global name ``name``; return its value, or ``{}`` if it is not set.

        Raise MasterUnreachableError if the master does not respond, RpcError if the call fails.
        """
        runtime = self._node._node
        value: object = await runtime.master("subscribeParam", runtime.uri, name)
        runtime.parameters.add(name)
        return value

    async def remove(self, name: str) -> None:
        """Unsubscribe from a parameter.

        Raise MasterUnreachableError if the master does not respond, RpcError if the call fails.
        """
        runtime = self._node._node
        runtime.parameters.discard(name)
        await runtime.master("unsubscribeParam", runtime.uri, name)

    def changed_in_worker(self, name: str, value: object) -> None:
        """Notify the listeners of a parameter update from the master."""
        with contextlib.suppress(RuntimeError):
            self._loop.call_soon_threadsafe(self._changed, name, value)

    def forgotten_in_worker(self) -> None:
        """Subscribe again, because the master has restarted and lost the subscriptions."""
        self._node._later(self._add_again)

    def _changed(self, name: str, value: object) -> None:
        # The master appends a slash if the changed name is below the subscribed one.
        for listener in list(self.listeners):
            listener(name.rstrip("/") or "/", value)

    async def _add_again(self) -> None:
        for name in list(self._node._node.parameters):
            with contextlib.suppress(MasterUnreachableError, RpcError):
                self._changed(name, await self.add(name))
