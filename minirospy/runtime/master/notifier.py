"""The master's calls to nodes: sequential for each node, but concurrent across nodes, so that no node delays another."""

from __future__ import annotations

import asyncio
import logging
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Protocol

from minirospy.base.errors import RpcError, RpcProtocolError, RpcUnreachable
from minirospy.base.steps import ALONE, Steps, is_small
from minirospy.core.graph.master_api import PARAMETERS, Notice
from minirospy.core.graph.parameters import ParameterUpdate
from minirospy.core.graph.registry import PublisherUpdate
from minirospy.core.wire.http import MAX_BODY, Body
from minirospy.core.wire.xmlrpc import serialize_call, serialize_call_in_steps
from minirospy.runtime.rpc.async_client import AsyncRpcClient
from minirospy.runtime.rpc.turns import Turns

__all__ = ["Notifier", "State"]

_log = logging.getLogger(__name__)

_MASTER = "/master"
MAX_CONCURRENT_CALLS = 200
CALLS_TO_SUSPECTS = 50
_MAX_SUSPECTS = 10000
_LONG_LIST = 200
_SECONDS_PER_PUBLISHER = 50e-6
_TICK = 0.001
HOLD_SECONDS = 0.02
_HOLD_TICK = 0.01

_SECONDS_PER_TURN = 0.003  # time limit in seconds per loop iteration for starting calls

# Maximum pending parameter notifications per node; beyond that, one notification per subscribed key replaces them
MAX_PARAMETERS = 32

# maximum total size in bytes of the large calls in progress; further calls are queued
_LARGE_BYTES = 32 * 1024 * 1024

# maximum bytes of a node's response to a notification; its contents are ignored
_MAX_ANSWER = 65536


class State(Protocol):
    """The interface to the current graph and parameters, read when a node is called."""

    def publisher_uris(self, topic: str) -> list[str]:
        """Return the URIs of a topic's publishers."""

    def parameter(self, key: str) -> object:
        """Return a parameter's value, or {} if it is not set; the value does not change afterwards."""

    def subscribed_parameters(self, uri: str) -> list[str]:
        """Return the keys that the node at ``uri`` has subscribed to."""


@dataclass(eq=False, slots=True)
class _Backlog:
    """A node's pending notifications: only the newest one for each topic and parameter."""

    uri: str
    notices: dict[object, Notice] = field(default_factory=dict)
    parameters: int = 0  # number of pending parameter notifications
    # The earliest time at which each topic's next notification may be sent
    pauses: dict[object, float] = field(default_factory=dict)
    timer: asyncio.TimerHandle | None = None


@dataclass(eq=False, slots=True)
class _Line:
    """A queue of nodes to call, at most ``most`` of them concurrently."""

    most: int
    under_way: int = 0
    waiting: deque[_Backlog] = field(default_factory=deque)


class Notifier:
    """Sends notifications to nodes. Nodes that did not respond to their last notification share a few call slots.

    Only the newest list of a topic's publishers, or value of a parameter, is queued: older ones are obsolete. Processing a
    very long list costs the receiver time, so if a topic has thousands of publishers, the next list is sent after a pause.
    """

    def __init__(self, state: State, turns: Turns, timeout: float, *, same_host: bool = True) -> None:
        """Create the notifier. ``turns`` runs long work; ``timeout`` is the time limit for a call, in seconds."""
        self._state = state
        self._turns = turns
        self._timeout = timeout
        self.rpc = AsyncRpcClient(same_host=same_host, max_answer=_MAX_ANSWER)

        self.here: dict[str, Callable[[str, list[str]], object]] = {}
        """For each node on this loop: the function to call, with a topic and its publishers, instead of an XML-RPC call.
        Keyed by URI.
        """
        self.nodes: dict[str, _Backlog] = {}
        # For each (URI, topic): the earliest time at which its next notification may be sent. Sorted by time.
        self._held: dict[tuple[str, str], float] = {}

        self.line = _Line(MAX_CONCURRENT_CALLS)
        self.suspect_line = _Line(CALLS_TO_SUSPECTS)
        self._suspects: set[str] = set()
        self._starts_soon = False
        self._closed = False

        # The last serialized update: cached, because all subscribers of a topic get the same bytes.
        self._last: tuple[str, list[str], bytes] = ("", [], b"")
        # The last large update of a topic or parameter: its name, its value and the serialized call.
        self._last_large: tuple[str, object, list[bytes]] = ("", None, [])

        # The queued large calls, the total bytes of those in progress, and whether one is being serialized.
        self._large: deque[Callable[[], None]] = deque()
        self._large_bytes = 0
        self._is_writing = False

    def defer(self, uri: str, topic: str) -> None:
        """Delay notifications to a node about ``topic`` (or PARAMETERS), because a pending response contains its current state.

        Otherwise a rospy node might receive the update before the response, and apply the older response last.
        """
        now = asyncio.get_running_loop().time()
        while self._held and next(iter(self._held.values())) <= now:
            del self._held[next(iter(self._held))]
        self._held.pop((uri, topic), None)
        # Round up to a tick, so that the master wakes up once for all delays that end within one tick.
        self._held[uri, topic] = (now // _HOLD_TICK + 1) * _HOLD_TICK + HOLD_SECONDS

    def send(self, notice: Notice) -> None:
        """Send a notification to its node soon."""
        key: object = object()
        end: float | None = None

        if isinstance(notice, PublisherUpdate):
            key = notice.topic
            end = self._held.get((notice.uri, notice.topic))
        elif isinstance(notice, ParameterUpdate):
            key = (notice.key,)
            end = self._held.get((notice.uri, PARAMETERS))

        node = self.nodes.get(notice.uri)
        is_idle = node is None or node.timer is not None
        if node is None:
            node = self.nodes[notice.uri] = _Backlog(notice.uri)

        if end and end > asyncio.get_running_loop().time():
            node.pauses[key] = max(end, node.pauses.get(key, 0.0))
        # Queue a parameter's notification after the pending ones for its parents and children.
        if isinstance(notice, ParameterUpdate) and node.notices.pop(key, None) is None:
            node.parameters += 1
        node.notices[key] = notice

        if node.parameters > MAX_PARAMETERS:
            self._summarize(node)
        if is_idle:
            self._go_on(node)

    async def close(self) -> None:
        """Discard the pending notifications."""
        self._closed = True
        for node in self.nodes.values():
            if node.timer:
                node.timer.cancel()
        await self.rpc.close()

    def _summarize(self, node: _Backlog) -> None:
        """Replace the notifications for many parameters with one for each key that the node has subscribed to."""
        for key in [key for key, notice in node.notices.items() if isinstance(notice, ParameterUpdate)]:
            del node.notices[key]
        for name in self._state.subscribed_parameters(node.uri):
            node.notices[name,] = ParameterUpdate(node.uri, name)
        node.parameters = 0

    def _line_up(self, node: _Backlog) -> None:
        (self.suspect_line if node.uri in self._suspects else self.line).waiting.append(node)
        self._start_soon()

    def _start_soon(self) -> None:
        # Do not start the calls immediately, so that the registering node gets its response first.
        if not self._starts_soon:
            self._starts_soon = True
            asyncio.get_running_loop().call_soon(self._start)

    def _start(self) -> None:
        self._starts_soon = False
        end = time.perf_counter() + _SECONDS_PER_TURN
        for line in (self.line, self.suspect_line):
            while line.waiting and line.under_way < line.most and not self._closed:
                if time.perf_counter() > end:
                    self._start_soon()
                    return
                self._call(line.waiting.popleft(), line)

    def _call(self, node: _Backlog, line: _Line) -> None:
        """Send a node its first notification that is not paused."""
        key = next((key for key in node.notices if key not in node.pauses), None)
        if key is None:
            self._go_on(node)
            return

        notice, count = node.notices.pop(key), 0
        line.under_way += 1
        if isinstance(notice, PublisherUpdate):
            publishers = self._state.publisher_uris(notice.topic)
            count = len(publishers)
            if node.uri in self.here:
                self.here[node.uri](notice.topic, publishers)
                self._called(node, line, notice, count, 0, b"")
                return
            if not is_small(publishers):
                self._call_later(node, line, notice, count)
                return
            body = self._update(notice.topic, publishers)
        elif isinstance(notice, ParameterUpdate):
            node.parameters = max(0, node.parameters - 1)
            value = self._state.parameter(notice.key)
            if not is_small(value):
                self._call_later(node, line, notice, count)
                return
            body = serialize_call("paramUpdate", [_MASTER, notice.key, value])
        else:
            body = serialize_call("shutdown", [_MASTER, f"[{notice.name}] Reason: {notice.reason}"])
        self.rpc.start(node.uri, body, self._timeout, partial(self._called, node, line, notice, count, 0))

    def _call_later(
        self, node: _Backlog, line: _Line, notice: PublisherUpdate | ParameterUpdate, count: int
    ) -> None:
        """Send a large notification as soon as the limit for large calls permits."""

        def start() -> None:
            self._turns.start(self._call_in_steps(node, line, notice, count))

        # First call the nodes that responded to their last notification.
        (self._large.append if line is self.suspect_line else self._large.appendleft)(start)
        self._start_large()

    def _start_large(self) -> None:
        if self._large and not self._is_writing and self._large_bytes < _LARGE_BYTES and not self._closed:
            self._is_writing = True
            self._large.popleft()()

    def _call_in_steps(
        self, node: _Backlog, line: _Line, notice: PublisherUpdate | ParameterUpdate, count: int
    ) -> Steps[None]:
        if isinstance(notice, PublisherUpdate):
            method, name = "publisherUpdate", notice.topic
            value: object = self._state.publisher_uris(name)
        else:
            method, name = "paramUpdate", notice.key
            value = self._state.parameter(name)

        is_known = self._last_large[0] == name and (
            value == self._last_large[1] if method == "publisherUpdate" else value is self._last_large[1]
        )
        if not is_known:
            self._last_large = ("", None, [])
            yield ALONE
            try:
                pieces = yield from serialize_call_in_steps(method, [_MASTER, name, value], MAX_BODY)
            except RpcProtocolError as error:
                self._is_writing = False
                self._called(node, line, notice, count, 0, error)
                return
            self._last_large = (name, value, pieces)

        self._is_writing = False
        body = self._last_large[2]
        size = sum(map(len, body))
        self._large_bytes += size
        done = partial(self._called, node, line, notice, count, size)
        self.rpc.start(node.uri, body, self._timeout, done)
        self._start_large()

    def _called(
        self, node: _Backlog, line: _Line, notice: Notice, count: int, size: int, answer: Body | RpcError
    ) -> None:
        """Continue after a call that notified the node of ``count`` publishers.

        ``size`` is the call's size in bytes, if the call was large.
        """

        line.under_way -= 1
        self._large_bytes -= size
        self._start_large()
        if not self._large and not self._large_bytes:
            self._last_large = ("", None, [])

        if isinstance(answer, RpcUnreachable):
            if len(self._suspects) > _MAX_SUSPECTS:
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

    def _go_on(self, node: _Backlog) -> None:
        """Queue the node if it has a notification that may be sent now.

        Otherwise set a timer for the end of its first pause, if any.
        """
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
            # Add a tick, because a timer may fire early by up to the clock's resolution.
            node.timer = loop.call_at(min(node.pauses.values()) + _TICK, self._go_on, node)
        else:
            del self.nodes[node.uri]

    def _update(self, topic: str, publishers: list[str]) -> bytes:
        """Serialize the call that reports a topic's publishers."""
        if self._last[:2] != (topic, publishers):
            body = serialize_call("publisherUpdate", [_MASTER, topic, publishers])
            self._last = (topic, publishers, body)
        return self._last[2]
