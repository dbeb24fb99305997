"""Fair queues for outgoing and incoming messages. A full flow drops its oldest messages. Pure.

The sender has one flow per topic, the receiver one per robot and topic. Each flow keeps its newest messages, and flows
are served round-robin, so that a flooding flow loses only its own messages.
"""

from __future__ import annotations

from collections import OrderedDict, deque
from dataclasses import dataclass, field
from typing import Generic, TypeVar

__all__ = ["Flow", "FlowQueue"]

_T = TypeVar("_T")


@dataclass(eq=False)
class Flow(Generic[_T]):
    """The queue of one flow, limited to ``max_waiting`` messages and ``max_bytes`` bytes. A single message may be larger."""

    max_waiting: int
    max_bytes: int
    passed: int = 0
    passed_bytes: int = 0
    dropped: int = 0
    waiting_bytes: int = 0
    waiting: deque[tuple[int, _T]] = field(default_factory=deque)


class FlowQueue(Generic[_T]):
    """Serves flows round-robin. Not thread-safe: the owner must hold a lock."""

    def __init__(self) -> None:
        self._ready: OrderedDict[Flow[_T], None] = OrderedDict()

    def __len__(self) -> int:
        return len(self._ready)

    def add(self, flow: Flow[_T], item: _T, size: int) -> int:
        """Append a message to a flow; return how many of the flow's messages were dropped to make room."""
        flow.waiting.append((size, item))
        flow.waiting_bytes += size
        dropped = 0
        while len(flow.waiting) > flow.max_waiting or (
            flow.waiting_bytes > flow.max_bytes and len(flow.waiting) > 1
        ):
            flow.waiting_bytes -= flow.waiting.popleft()[0]
            dropped += 1
        flow.dropped += dropped
        self._ready.setdefault(flow, None)
        return dropped

    def pop(self) -> tuple[Flow[_T], _T] | None:
        """Return the next message and its flow in round-robin order, or None if the queue is empty."""
        while self._ready:
            flow, _ = self._ready.popitem(last=False)
            if not flow.waiting:
                continue
            size, item = flow.waiting.popleft()
            flow.waiting_bytes -= size
            flow.passed += 1
            flow.passed_bytes += size
            if flow.waiting:
                self._ready[flow] = None
            return flow, item
        return None

    def forget(self, flow: Flow[_T]) -> None:
        """Drop the queued messages of a closed flow."""
        flow.waiting.clear()
        flow.waiting_bytes = 0
        self._ready.pop(flow, None)
