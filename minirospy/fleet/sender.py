"""Queues with threads that pass messages to and from Zenoh, so that the event loop delays neither direction."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from typing import TypeAlias

from minirospy.aio.tasks import ErrorReporter
from minirospy.fleet.flows import Flow, FlowQueue
from minirospy.fleet.keys import Stamp, serialize_stamp
from minirospy.fleet.network import FleetNetwork, Outlet
from minirospy.fleet.rules import Priority, Throttle

__all__ = ["Outflow", "Receiver", "Sender"]

_log = logging.getLogger(__name__)
_CLOSE_SECONDS = 2.0
_MAX_WAITING = {Priority.TELEOP: 10, Priority.DATA: 100, Priority.BULK: 2}
_MAX_BYTES = {Priority.TELEOP: 1 << 20, Priority.DATA: 8 << 20, Priority.BULK: 32 << 20}
_INTAKE_MESSAGES, _INTAKE_BYTES = 200, 32 << 20
MAX_OUTLETS = 64
"""Maximum number of cached Zenoh publishers per flow: one for the flow's key, the others to replay latched messages.

The least recently used publisher is dropped.
"""


class _Worker:
    """A thread that processes a queue. It starts when the first item is queued."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._lock = threading.RLock()
        self._condition = threading.Condition(self._lock)
        self._thread: threading.Thread | None = None
        self._is_closed = False

    def close(self) -> None:
        """Stop the thread. Wait for it at most two seconds, because it may be blocked in Zenoh. Idempotent."""
        with self._lock:
            self._is_closed = True
            self._condition.notify_all()
        if self._thread:
            self._thread.join(_CLOSE_SECONDS)

    def _wake(self) -> None:
        """Start or wake the thread. The caller holds the lock."""
        if self._thread is None and not self._is_closed:
            self._thread = threading.Thread(target=self._run, name=self._name, daemon=True)
            self._thread.start()
        self._condition.notify()

    def _run(self) -> None:
        raise NotImplementedError


class Outflow:
    """A queue of messages from one topic to the fleet; created by :meth:`Sender.flow`.

    ``send`` may be called from any thread.
    """

    def __init__(self, worker: _PriorityWorker, priority: Priority, hertz: float, is_bare: bool) -> None:
        self.priority = priority
        self.is_bare = is_bare
        self.throttled = 0
        self._worker = worker
        self._throttle = Throttle(hertz)
        self._flow: Flow[tuple[str, bytes]] = Flow(_MAX_WAITING[priority], _MAX_BYTES[priority])
        self.outlets: dict[str, Outlet] = {}
        self.numbers: dict[str, int] = {}

    @property
    def sent(self) -> int:
        """Return the number of messages passed to Zenoh."""
        return self._flow.passed

    @property
    def sent_bytes(self) -> int:
        """Return the total size of the messages passed to Zenoh, in bytes."""
        return self._flow.passed_bytes

    @property
    def dropped(self) -> int:
        """Return how many messages were replaced by newer ones because the network was too slow."""
        return self._flow.dropped

    def send(self, key: str, message: bytes, *, always: bool = False) -> None:
        """Queue a message. Apply the rate limit unless ``always`` is true."""
        if not always and not self._throttle.allows(time.monotonic()):
            self.throttled += 1
            return
        self._worker.add(self, key, message)

    def close(self) -> None:
        """Drop all queued messages, and undeclare the publishers."""
        self._worker.end(self)


class _PriorityWorker(_Worker):
    def __init__(self, priority: Priority, network: FleetNetwork, clock: Callable[[], int]) -> None:
        super().__init__(f"fleet-{priority.name.lower()}")
        self._priority = priority
        self._network = network
        self._clock = clock
        self._queue: FlowQueue[tuple[str, bytes]] = FlowQueue()
        self._owners: dict[Flow[tuple[str, bytes]], Outflow] = {}
        self._ended: list[Outflow] = []

    def add(self, outflow: Outflow, key: str, message: bytes) -> None:
        with self._lock:
            if not self._is_closed:
                self._owners[outflow._flow] = outflow
                self._queue.add(outflow._flow, (key, message), len(message))
                self._wake()

    def end(self, outflow: Outflow) -> None:
        with self._lock:
            self._queue.forget(outflow._flow)
            if self._owners.pop(outflow._flow, None):
                self._ended.append(outflow)
                self._wake()

    def _run(self) -> None:
        while True:
            with self._lock:
                while not (self._is_closed or self._queue or self._ended):
                    self._condition.wait()
                if self._is_closed:
                    return
                ended, self._ended = self._ended, []
                taken = self._queue.pop()
                outflow = self._owners.get(taken[0]) if taken else None
            try:
                for each in ended:
                    for outlet in each.outlets.values():
                        outlet.undeclare()
                if taken and outflow:
                    self.put(outflow, *taken[1])
            except Exception as error:  # noqa: BLE001 - Zenoh raises if the session is closed or a link is lost
                _log.debug("a message was not sent: %s", error)

    def put(self, outflow: Outflow, key: str, message: bytes) -> None:
        outlet = outflow.outlets.pop(key, None)
        if outlet is None:
            while len(outflow.outlets) >= MAX_OUTLETS:
                oldest = next(iter(outflow.outlets))
                outflow.numbers.pop(oldest, None)
                outflow.outlets.pop(oldest).undeclare()
            make = self._network.outlet_to_others if outflow.is_bare else self._network.outlet
            outlet = make(key, self._priority)
        outflow.outlets[key] = outlet
        if outflow.is_bare:
            outlet.put(message)
            return
        number = outflow.numbers[key] = outflow.numbers.get(key, 0) + 1
        outlet.put(message, attachment=serialize_stamp(Stamp(number, self._clock())))


class Sender:
    """Sends messages to the fleet. Each priority has its own thread, so that a large message does not delay a command."""

    def __init__(self, network: FleetNetwork, clock: Callable[[], int] = time.time_ns) -> None:
        """Create the sender. ``clock`` returns the send time in ns that is attached to each message."""
        self.priorities = {priority: _PriorityWorker(priority, network, clock) for priority in Priority}

    def flow(self, priority: Priority, hertz: float = 0.0, *, is_bare: bool = False) -> Outflow:
        """Return a new flow for a topic, limited to ``hertz`` messages per second (0: unlimited).

        If ``is_bare``, send messages without stamps, for third-party programs.
        """
        return Outflow(self.priorities[priority], priority, hertz, is_bare)

    def close(self) -> None:
        """Stop the threads. Idempotent."""
        for worker in self.priorities.values():
            worker.close()


_Arrival: TypeAlias = tuple[Callable[[bytes, bytes], object], bytes, bytes]
"""(function that delivers a message, message, attachment)"""


class Flows:
    """A receiver's flows by key. At the limit, a new flow replaces the idle one that was used least recently. Thread-safe."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._lock = threading.Lock()
        self._flows: dict[object, Flow[_Arrival]] = {}

    def of(self, key: object) -> Flow[_Arrival] | None:
        """Return the flow for a key, or None if there are too many flows and each has queued messages."""
        with self._lock:
            flow = self._flows.pop(key, None)
            if flow is None:
                if len(self._flows) >= self._most:
                    idle = next((known for known, each in self._flows.items() if not each.waiting), None)
                    if idle is None:
                        return None
                    del self._flows[idle]
                flow = Receiver.flow()
            self._flows[key] = flow
            return flow


class Receiver(_Worker):
    """Queues received messages, and publishes them in a thread, alternating between the robots' topics.

    Publishing to a slow subscriber may block for some milliseconds, which in Zenoh's own thread would delay all robots.
    """

    def __init__(self) -> None:
        super().__init__("fleet-receiver")
        self._reporter = ErrorReporter(_log, "publishing a message of the fleet")
        self._queue: FlowQueue[_Arrival] = FlowQueue()

    @staticmethod
    def flow() -> Flow[_Arrival]:
        """Return a new flow for a topic of a robot."""
        return Flow(_INTAKE_MESSAGES, _INTAKE_BYTES)

    @staticmethod
    def flows(most: int) -> Flows:
        """Return a new table of at most ``most`` flows."""
        return Flows(most)

    def add(
        self,
        flow: Flow[_Arrival],
        deliver: Callable[[bytes, bytes], object],
        message: bytes,
        attachment: bytes,
    ) -> None:
        """Queue a message; the receiver's thread then calls ``deliver(message, attachment)``."""
        with self._lock:
            if not self._is_closed:
                self._queue.add(flow, (deliver, message, attachment), len(message))
                self._wake()

    def _run(self) -> None:
        while True:
            with self._lock:
                while not (self._is_closed or self._queue):
                    self._condition.wait()
                if self._is_closed:
                    return
                taken = self._queue.pop()
            if taken:
                deliver, message, attachment = taken[1]
                try:
                    deliver(message, attachment)
                except Exception as error:  # noqa: BLE001 - one message's error must not stop the others
                    self._reporter.report(error)
