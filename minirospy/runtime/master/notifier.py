"""The master's calls to nodes: in order for each node, side by side for all, so that none waits for another."""

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
_CALLS_AT_ONCE = 200
_CALLS_TO_SUSPECTS = 50
_MAX_SUSPECTS = 10000
_LONG_LIST = 200
_SECONDS_PER_PUBLISHER = 50e-6
_TICK = 0.001
_HOLD_SECONDS = 0.02
_HOLD_TICK = 0.01

_SECONDS_PER_TURN = 0.003
"""Of the loop, for starting calls."""

_MAX_PARAMETERS = 32
"""Parameters of which a node is still to be notified; beyond that, those that it has subscribed to are one each."""

_LARGE_BYTES = 32 * 1024 * 1024
"""Bytes of large calls that are under way, before the next one waits."""

_MAX_ANSWER = 65536
"""Nobody reads what a node answers to a notice."""


class State(Protocol):
    """The graph and the parameters, as they are when a node is called."""

    def publisher_uris(self, topic: str) -> list[str]:
        """Return the URIs of a topic's publishers."""

    def parameter(self, key: str) -> object:
        """Return a parameter's value, {} where it is not set; it is not changed afterwards."""

    def subscribed_parameters(self, uri: str) -> list[str]:
        """Return the keys that the node at ``uri`` has subscribed to."""


@dataclass(eq=False, slots=True)
class _Backlog:
    """The pending notifications of one node: the newest of each topic and parameter."""

    uri: str
    notices: dict[object, Notice] = field(default_factory=dict)
    parameters: int = 0
    """How many of them are of parameters."""
    pauses: dict[object, float] = field(default_factory=dict)
    """Until when no more is said of a topic."""
    timer: asyncio.TimerHandle | None = None


@dataclass(eq=False, slots=True)
class _Line:
    """Nodes that wait for their call; ``most`` are called concurrently."""

    most: int
    under_way: int = 0
    waiting: deque[_Backlog] = field(default_factory=deque)


class Notifier:
    """Sends notices. A node that did not answer the last one shares a few slots with its like.

    Of a topic's publishers, or a parameter's values, only the newest waits: an older one is of no use to
    anybody. A very long list costs its reader time, so of a topic with thousands of publishers the next list
    follows after a pause.
    """

    def __init__(self, state: State, turns: Turns, timeout: float, *, same_host: bool = True) -> None:
        """Take ``turns``, which run what takes long, and ``timeout``, the seconds that a call may take."""
        self._state = state
        self._turns = turns
        self._timeout = timeout
        self._rpc = AsyncRpcClient(same_host=same_host, max_answer=_MAX_ANSWER)

        self.here: dict[str, Callable[[str, list[str]], object]] = {}
        """URI of a node on this loop -> what takes a topic and its publishers in place of a call."""
        self._nodes: dict[str, _Backlog] = {}
        # URI and topic -> until when nothing is said of it, the first to end in front.
        self._held: dict[tuple[str, str], float] = {}

        self._line = _Line(_CALLS_AT_ONCE)
        self._suspect_line = _Line(_CALLS_TO_SUSPECTS)
        self._suspects: set[str] = set()
        self._starts_soon = False
        self._closed = False

        # The last update that was written: the subscribers of one topic all get the same bytes.
        self._last: tuple[str, list[str], bytes] = ("", [], b"")
        # The same for a large one, of a topic or a parameter.
        self._last_large: tuple[str, object, list[bytes]] = ("", None, [])

        # Large calls that wait; bytes of those that are under way; whether one is being written.
        self._large: deque[Callable[[], None]] = deque()
        self._large_bytes = 0
        self._is_writing = False

    def defer(self, uri: str, topic: str) -> None:
        """Delay notices to a node whose answer reports a topic, or PARAMETERS, as it is now.

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
            node = self._nodes[notice.uri] = _Backlog(notice.uri)

        if end and end > asyncio.get_running_loop().time():
            node.pauses[key] = max(end, node.pauses.get(key, 0.0))
        # A parameter comes after what was sent of its parents and children meanwhile.
        if isinstance(notice, ParameterUpdate) and node.notices.pop(key, None) is None:
            node.parameters += 1
        node.notices[key] = notice

        if node.parameters > _MAX_PARAMETERS:
            self._summarize(node)
        if is_idle:
            self._go_on(node)

    async def close(self) -> None:
        """Give up what waits."""
        self._closed = True
        for node in self._nodes.values():
            if node.timer:
                node.timer.cancel()
        await self._rpc.close()

    def _summarize(self, node: _Backlog) -> None:
        """Replace the notices of many parameters by one for each subscription of the node."""
        for key in [key for key, notice in node.notices.items() if isinstance(notice, ParameterUpdate)]:
            del node.notices[key]
        for name in self._state.subscribed_parameters(node.uri):
            node.notices[name,] = ParameterUpdate(node.uri, name)
        node.parameters = 0

    def _line_up(self, node: _Backlog) -> None:
        (self._suspect_line if node.uri in self._suspects else self._line).waiting.append(node)
        self._start_soon()

    def _start_soon(self) -> None:
        # Not immediately: the registering node gets its answer first.
        if not self._starts_soon:
            self._starts_soon = True
            asyncio.get_running_loop().call_soon(self._start)

    def _start(self) -> None:
        self._starts_soon = False
        end = time.perf_counter() + _SECONDS_PER_TURN
        for line in (self._line, self._suspect_line):
            while line.waiting and line.under_way < line.most and not self._closed:
                if time.perf_counter() > end:
                    self._start_soon()
                    return
                self._call(line.waiting.popleft(), line)

    def _call(self, node: _Backlog, line: _Line) -> None:
        """Send a node the first notice that need not wait."""
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
        self._rpc.start(node.uri, body, self._timeout, partial(self._called, node, line, notice, count, 0))

    def _call_later(
        self, node: _Backlog, line: _Line, notice: PublisherUpdate | ParameterUpdate, count: int
    ) -> None:
        """Send a large notice as soon as there is memory for it."""

        def start() -> None:
            self._turns.start(self._call_in_steps(node, line, notice, count))

        # Nodes that answered last time come first.
        (self._large.append if line is self._suspect_line else self._large.appendleft)(start)
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
        self._rpc.start(node.uri, body, self._timeout, done)
        self._start_large()

    def _called(
        self, node: _Backlog, line: _Line, notice: Notice, count: int, size: int, answer: Body | RpcError
    ) -> None:
        """Go on after a call that listed ``count`` publishers, ``size`` bytes if it was large."""

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
        """Return the call that reports a topic's publishers."""
        if self._last[:2] != (topic, publishers):
            body = serialize_call("publisherUpdate", [_MASTER, topic, publishers])
            self._last = (topic, publishers, body)
        return self._last[2]
