"""The master's calls to nodes: in order for each node, side by side for all, so that none waits for another."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from typing import Any

from minirospy.errors import RpcError, RpcUnreachable
from minirospy.graph.parameters import ParameterUpdate
from minirospy.graph.registry import NodeShutdown, PublisherUpdate
from minirospy.runtime.rpc_async import AsyncRpcClient
from minirospy.wire.xmlrpc import serialize_call

__all__ = ["Notice", "Notifier"]

_log = logging.getLogger(__name__)

_MASTER = "/master"
_CALLS_AT_ONCE = 200
_CALLS_TO_SUSPECTS = 50
_LONG_LIST = 200
_SECONDS_PER_PUBLISHER = 50e-6

Notice = PublisherUpdate | NodeShutdown | ParameterUpdate


class Notifier:
    """Sends notices. A node that did not answer the last one shares a few slots with its like.

    Of a topic's publishers, or a parameter's values, only the newest waits: an older one is of no use to
    anybody. A very long list costs its reader time, so of a topic with thousands of publishers the next list
    follows after a pause.
    """

    def __init__(self, publishers: Callable[[str], list[str]], timeout: float) -> None:
        """``publishers(topic)``: the list as it is now. ``timeout``: seconds that a call may take."""
        self._publishers = publishers
        self._timeout = timeout
        self._rpc = AsyncRpcClient()
        self._waiting: dict[str, dict[object, Notice]] = {}
        self._tasks: set[asyncio.Task[None]] = set()
        self._slots = asyncio.Semaphore(_CALLS_AT_ONCE)
        self._suspect_slots = asyncio.Semaphore(_CALLS_TO_SUSPECTS)
        self._suspects: set[str] = set()
        # The last update that was written: the subscribers of one topic all get the same bytes.
        self._last: tuple[str, int, bytes] = ("", 0, b"")

    def send(self, notice: Notice) -> None:
        """Call the node that the notice is for, soon."""
        if isinstance(notice, PublisherUpdate):
            key: object = notice.topic
            if self._last[0] == notice.topic:
                self._last = ("", 0, b"")
        else:
            key = (notice.key,) if isinstance(notice, ParameterUpdate) else object()
        waiting = self._waiting.get(notice.uri)
        if waiting is None:
            waiting = self._waiting[notice.uri] = {}
            task = asyncio.get_running_loop().create_task(self._serve(notice.uri, waiting))
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)
        if isinstance(notice, ParameterUpdate):
            # Behind what was said of its parents and children meanwhile.
            waiting.pop(key, None)
        waiting[key] = notice

    async def close(self) -> None:
        """Give up what waits."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        await self._rpc.close()

    async def _serve(self, uri: str, waiting: dict[object, Notice]) -> None:
        loop = asyncio.get_running_loop()
        pauses: dict[object, float] = {}
        try:
            while waiting or pauses:
                pauses = {key: end for key, end in pauses.items() if end > loop.time()}
                key = next((key for key in waiting if key not in pauses), None)
                if key is None:
                    if pauses:
                        await asyncio.sleep(min(pauses.values()) - loop.time())
                    continue
                notice = waiting.pop(key)
                async with self._suspect_slots if uri in self._suspects else self._slots:
                    count = await self._call(uri, notice)
                if count > _LONG_LIST:
                    pauses[key] = loop.time() + count * _SECONDS_PER_PUBLISHER
        finally:
            del self._waiting[uri]

    async def _call(self, uri: str, notice: Notice) -> int:
        """Call the node; how many publishers it was told of."""
        count = 0
        if isinstance(notice, PublisherUpdate):
            count, body = self._update(notice.topic)
        elif isinstance(notice, ParameterUpdate):
            body = serialize_call("paramUpdate", [_MASTER, notice.key, notice.value])
        else:
            body = serialize_call("shutdown", [_MASTER, f"[{notice.name}] Reason: {notice.reason}"])
        try:
            # Nobody asks what it answers.
            await self._rpc.post(uri, body, self._timeout)
            self._suspects.discard(uri)
        except RpcError as error:
            if isinstance(error, RpcUnreachable):
                if len(self._suspects) > 10000:
                    self._suspects.clear()
                self._suspects.add(uri)
            _log.info("%s to %s: %s", type(notice).__name__, uri, error)
        return count

    def _update(self, topic: str) -> tuple[int, bytes]:
        if self._last[0] != topic:
            publishers: list[Any] = self._publishers(topic)
            body = serialize_call("publisherUpdate", [_MASTER, topic, publishers])
            self._last = (topic, len(publishers), body)
        return self._last[1:]
