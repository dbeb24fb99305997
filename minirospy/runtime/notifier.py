"""The master's calls to nodes: in order for each node, side by side for all, so that none waits for another."""

from __future__ import annotations

import asyncio
import logging
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

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
_MOST_SUSPECTS = 10000
_LONG_LIST = 200
_SECONDS_PER_PUBLISHER = 50e-6
_TICK = 0.001

Notice = PublisherUpdate | NodeShutdown | ParameterUpdate


@dataclass(eq=False, slots=True)
class _Node:
    """What one node is still to be told: the newest of each topic and parameter."""

    uri: str
    notices: dict[object, Notice] = field(default_factory=dict)
    pauses: dict[object, float] = field(default_factory=dict)
    """Until when no more is said of a topic."""
    timer: asyncio.TimerHandle | None = None


@dataclass(eq=False, slots=True)
class _Line:
    """Nodes that wait for their call; ``most`` are called at once."""

    most: int
    under_way: int = 0
    waiting: deque[_Node] = field(default_factory=deque)


class Notifier:
    """Sends notices. A node that did not answer the last one shares a few slots with its like.

    Of a topic's publishers, or a parameter's values, only the newest waits: an older one is of no use to
    anybody. A very long list costs its reader time, so of a topic with thousands of publishers the next list
    follows after a pause.
    """

    def __init__(
        self, publishers: Callable[[str], list[str]], timeout: float, *, nearby: bool = True
    ) -> None:
        """``publishers(topic)``: the list as it is now. ``timeout``: seconds that a call may take."""
        self._publishers = publishers
        self._timeout = timeout
        self._rpc = AsyncRpcClient(nearby=nearby)
        self.here: dict[str, Callable[[str, list[str]], object]] = {}
        """URI of a node on this loop -> what takes a topic and its publishers in place of a call."""
        self._nodes: dict[str, _Node] = {}
        self._line = _Line(_CALLS_AT_ONCE)
        self._suspect_line = _Line(_CALLS_TO_SUSPECTS)
        self._suspects: set[str] = set()
        self._starts_soon = False
        self._closed = False
        # The last update that was written: the subscribers of one topic all get the same bytes.
        self._last: tuple[str, list[str], bytes] = ("", [], b"")

    def send(self, notice: Notice) -> None:
        """Call the node that the notice is for, soon."""
        if isinstance(notice, PublisherUpdate):
            key: object = notice.topic
        else:
            key = (notice.key,) if isinstance(notice, ParameterUpdate) else object()
        node = self._nodes.get(notice.uri)
        if node is None:
            node = self._nodes[notice.uri] = _Node(notice.uri)
            self._line_up(node)
        elif node.timer and key not in node.pauses:
            # It pauses on account of another topic.
            node.timer.cancel()
            node.timer = None
            self._line_up(node)
        if isinstance(notice, ParameterUpdate):
            # Behind what was said of its parents and children meanwhile.
            node.notices.pop(key, None)
        node.notices[key] = notice

    async def close(self) -> None:
        """Give up what waits."""
        self._closed = True
        for node in self._nodes.values():
            if node.timer:
                node.timer.cancel()
        await self._rpc.close()

    def _line_up(self, node: _Node) -> None:
        (self._suspect_line if node.uri in self._suspects else self._line).waiting.append(node)
        self._start_soon()

    def _start_soon(self) -> None:
        # Not at once: who registers gets its answer first.
        if not self._starts_soon:
            self._starts_soon = True
            asyncio.get_running_loop().call_soon(self._start)

    def _start(self) -> None:
        self._starts_soon = False
        for line in (self._line, self._suspect_line):
            while line.waiting and line.under_way < line.most and not self._closed:
                self._call(line.waiting.popleft(), line)

    def _call(self, node: _Node, line: _Line) -> None:
        """Tell a node the first thing that need not wait."""
        key = next((key for key in node.notices if key not in node.pauses), None)
        if key is None:
            self._pause(node)
            return
        notice, count = node.notices.pop(key), 0
        line.under_way += 1
        if isinstance(notice, PublisherUpdate):
            publishers = self._publishers(notice.topic)
            count = len(publishers)
            if node.uri in self.here:
                self.here[node.uri](notice.topic, publishers)
                self._called(node, line, notice, count, b"")
                return
            body = self._update(notice.topic, publishers)
        elif isinstance(notice, ParameterUpdate):
            body = serialize_call("paramUpdate", [_MASTER, notice.key, notice.value])
        else:
            body = serialize_call("shutdown", [_MASTER, f"[{notice.name}] Reason: {notice.reason}"])
        self._rpc.begin(node.uri, body, self._timeout, partial(self._called, node, line, notice, count))

    def _called(self, node: _Node, line: _Line, notice: Notice, count: int, answer: bytes | RpcError) -> None:
        """A call is done, which told of ``count`` publishers; nobody asks what was answered."""
        line.under_way -= 1
        if isinstance(answer, RpcUnreachable):
            if len(self._suspects) > _MOST_SUSPECTS:
                self._suspects.clear()
            self._suspects.add(node.uri)
        else:
            self._suspects.discard(node.uri)
        if isinstance(answer, RpcError):
            _log.info("%s to %s: %s", type(notice).__name__, node.uri, answer)
        if self._closed:
            return
        if isinstance(notice, PublisherUpdate) and count > _LONG_LIST:
            node.pauses[notice.topic] = asyncio.get_running_loop().time() + count * _SECONDS_PER_PUBLISHER
        self._go_on(node)
        if line.waiting:
            self._start_soon()

    def _go_on(self, node: _Node) -> None:
        node.timer = None
        if node.pauses:
            now = asyncio.get_running_loop().time()
            node.pauses = {key: end for key, end in node.pauses.items() if end > now}
        if node.notices:
            self._line_up(node)
        else:
            self._pause(node)

    def _pause(self, node: _Node) -> None:
        """Nothing is to be said now: until the first pause ends, if there is one."""
        if node.pauses:
            loop = asyncio.get_running_loop()
            # A timer may be early by as much as the clock's resolution.
            node.timer = loop.call_at(min(node.pauses.values()) + _TICK, self._go_on, node)
        else:
            del self._nodes[node.uri]

    def _update(self, topic: str, publishers: list[str]) -> bytes:
        """The call that tells of a topic's publishers."""
        if self._last[:2] != (topic, publishers):
            body = serialize_call("publisherUpdate", [_MASTER, topic, publishers])
            self._last = (topic, publishers, body)
        return self._last[2]
