"""Publish from a control loop without waiting: ``from realtime_tools import RealtimePublisher``.

ROS's package has only C++ headers. Source: http://wiki.ros.org/realtime_tools.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from queue import SimpleQueue
from typing import Generic, TypeVar

from minirospy import client as rospy
from minirospy.core.idl.protocols import Message

__all__ = ["RealtimePublisher"]

_T = TypeVar("_T", bound=Message)


class RealtimePublisher(Generic[_T]):
    """A publisher whose :meth:`publish` returns at once: one thread, common to all of them, sends the messages.

    A message must not be changed after it was published.
    """

    def __init__(self, topic: str, message_class: type[_T], latch: bool = False, queue_size: int = 1) -> None:
        self._publisher = rospy.Publisher(topic, message_class, latch=latch, queue_size=queue_size)
        self._waiting: deque[_T] = deque()
        self._queue_size = queue_size

    def publish(self, message: _T) -> bool:
        """Hand a message to the thread. Return False, and drop it, if ``queue_size`` messages still wait to be sent."""
        if len(self._waiting) >= self._queue_size:
            return False
        self._waiting.append(message)
        _sender().put(self._send_waiting)
        return True

    def close(self) -> None:
        """Close the topic; messages that still wait are dropped."""
        self._waiting.clear()
        self._publisher.unregister()

    def _send_waiting(self) -> None:
        """Send the oldest message that waits, if any."""
        try:
            message = self._waiting.popleft()
            self._publisher.publish(message)
        except (IndexError, rospy.ROSException):
            pass  # closed, or the node shuts down


_lock = threading.Lock()
_queues: list[SimpleQueue[Callable[[], None]]] = []


def _sender() -> SimpleQueue[Callable[[], None]]:
    """Return the queue of the common thread, which is started at first use."""
    if not _queues:
        with _lock:
            if not _queues:
                queue: SimpleQueue[Callable[[], None]] = SimpleQueue()
                threading.Thread(target=_send, args=(queue,), daemon=True, name="realtime publisher").start()
                _queues.append(queue)
    return _queues[0]


def _send(queue: SimpleQueue[Callable[[], None]]) -> None:
    while True:
        queue.get()()
