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

__all__ = ["PARAMETERS", "Notice", "Notifier"]

_log = logging.getLogger(__name__)

_MASTER = "/master"
_CALLS_AT_ONCE = 200
_CALLS_TO_SUSPECTS = 50
_MOST_SUSPECTS = 10000
_LONG_LIST = 200
_SECONDS_PER_PUBLISHER = 50e-6
_TICK = 0.001
_HOLD_SECONDS = 0.02
_HOLD_TICK = 0.01

PARAMETERS = ""
"""For :meth:`Notifier.hold`: no topic has this name."""

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
        # URI and topic -> until when nothing is said of it, the first to end in front.
        self._held: dict[tuple[str, str], float] = {}
        self._line = _Line(_CALLS_AT_ONCE)
        self._suspect_line = _Line(_CALLS_TO_SUSPECTS)
        self._suspects: set[str] = set()
        self._starts_soon = False
        self._closed = False
        # The last update that was written: the subscribers of one topic all get the same bytes.
        self._last: tuple[str, list[str], bytes] = ("", [], b"")

    def hold(self, uri: str, topic: str) -> None:
        """The node gets an answer that tells how a topic, or PARAMETERS, is now: a change is told a moment later.

        A node of rospy that takes the update first and then the answer goes by the answer, the older of the two.
        """
        now = asyncio.get_running_loop().time()
        while self._held and next(iter(self._held.values())) <= now:
            del self._held[next(iter(self._held))]
        self._held.pop((uri, topic), None)
        # All that end within one tick wake the master once.
        self._held[uri, topic] = (now // _HOLD_TICK + 1) * _HOLD_TICK + _HOLD_SECONDS

    def send(self, notice: Notice) -> None:
        """Call the node that the notice is for, soon."""
        key: object = object()
        end: float | None = None
        if isinstance(notice, PublisherUpdate):
            key = notice.topic
            end = self._held.get((notice.uri, notice.topic))
        elif isinstance(notice, ParameterUpdate):
            key = (notice.key,)
            end = self._held.get((notice.uri, PARAMETERS))
        node = self._nodes.get(notice.uri)
        is_idle = node is None or node.timer is not None
        if node is None:
            node = self._nodes[notice.uri] = _Node(notice.uri)
        if end and end > asyncio.get_running_loop().time():
            node.pauses[key] = max(end, node.pauses.get(key, 0.0))
        if isinstance(notice, ParameterUpdate):
            # Behind what was said of its parents and children meanwhile.
            node.notices.pop(key, None)
        node.notices[key] = notice
        if is_idle:
            self._go_on(node)

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
            self._go_on(node)
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
        """Line the node up where there is something to say; else wait for the end of a pause, if there is one."""
        if node.timer:
            node.timer.cancel()
            node.timer = None
        loop = asyncio.get_running_loop()
        if node.pauses:
            now = loop.time()
            node.pauses = {key: end for key, end in node.pauses.items() if end > now}
        if any(key not in node.pauses for key in node.notices):
            self._line_up(node)
        elif node.pauses:
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
