"""Publish and serve actions from a control loop without blocking: ``from realtime_tools import RealtimePublisher``.

ROS's package has only C++ headers. Source: http://wiki.ros.org/realtime_tools.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from queue import SimpleQueue
from typing import Any, Generic, TypeVar

from minirospy import client as rospy
from minirospy.core.control.goal import CANCELLED, MonitoredGoal, Outcome
from minirospy.core.graph.goals import GoalEvent
from minirospy.core.idl.protocols import Action, Message
from minirospy.ros.actionlib.actionlib.handle import ServerGoalHandle
from minirospy.ros.actionlib.actionlib.server import ActionServer

__all__ = ["GoalEvent", "MonitoredGoal", "Outcome", "RealtimeActionServer", "RealtimePublisher", "Rejection"]

_T = TypeVar("_T", bound=Message)


class RealtimePublisher(Generic[_T]):
    """A publisher whose :meth:`publish` returns immediately. One thread sends the messages of all such publishers.

    Do not change a message after publishing it.
    """

    def __init__(self, topic: str, message_class: type[_T], latch: bool = False, queue_size: int = 1) -> None:
        self._publisher = rospy.Publisher(topic, message_class, latch=latch, queue_size=queue_size)
        self._waiting: deque[_T] = deque()
        self._queue_size = queue_size

    def publish(self, message: _T) -> bool:
        """Queue a message for the sender thread, or drop it and return False if ``queue_size`` messages are already queued."""
        if len(self._waiting) >= self._queue_size:
            return False
        self._waiting.append(message)
        _sender().put(self._send_waiting)
        return True

    def close(self) -> None:
        """Close the topic and drop queued messages."""
        self._waiting.clear()
        self._publisher.unregister()

    def _send_waiting(self) -> None:
        """Send the oldest queued message, if any."""
        try:
            message = self._waiting.popleft()
            self._publisher.publish(message)
        except (IndexError, rospy.ROSException):
            pass  # the topic is closed or the node is shutting down


class Rejection(Exception):
    """Raised by a RealtimeActionServer's ``accept`` to reject a goal, with a result and a status text."""

    def __init__(self, result: Message, text: str = "") -> None:
        super().__init__(text)
        self.result = result


class RealtimeActionServer:
    """An action server for a control loop, with one active goal at a time. A new goal preempts the active one.

    ``accept(message)`` runs in another thread: it checks a goal, queues it for the loop, and returns it as a goal whose outcome
    the loop will decide; or it raises Rejection. ``cancel()`` makes the loop stop because a client has cancelled the active goal.
    ``make_result(outcome)`` returns the result message. ``period``: ns of ROS time between feedback messages. A success is
    reported at the next feedback time; all other outcomes are reported immediately.
    """

    def __init__(
        self,
        name: str,
        action: type[Action],
        accept: Callable[[Any], MonitoredGoal],
        cancel: Callable[[], None],
        make_result: Callable[[Outcome], Message],
        period: int,
    ) -> None:
        self._accept = accept
        self._cancel = cancel
        self._make_result = make_result
        self._period = period
        self._active: _Active | None = None
        self._is_running = False
        self._server = ActionServer(name, action, self._receive, self._receive_cancel, auto_start=False)
        self._server.start()

    def start(self) -> None:
        """Record that the loop is running. Call this, :meth:`report` and :meth:`stop` in the loop's thread."""
        self._is_running = True

    def report(self, time: int) -> bool:
        """Report the active goal's outcome, if it is known; return whether feedback is due. ``time`` is ROS time in ns."""
        active = self._active
        if active is None:
            return False
        outcome, period = active.goal.outcome, self._period
        if active.due is None or active.due - time > period:
            active.due = time + period  # first cycle of this goal, or ROS time has jumped back
        is_due = time >= active.due
        if is_due:
            active.due += period * (1 + (time - active.due) // period)
        if outcome is None:
            return is_due
        if is_due or outcome.event is not GoalEvent.SUCCEED:
            self._finish(active, _call_soon)
        return False

    def publish_feedback(self, feedback: Message) -> None:
        """Send feedback on the active goal."""
        if active := self._active:
            _call_soon(lambda: active.handle.publish_feedback(feedback))

    def preempt(self) -> None:
        """Cancel the active goal, if any. Call this from any thread except the loop's."""
        if active := self._active:
            self._finish(active, _call)

    def stop(self) -> None:
        """Cancel the active goal, if any, because the loop is no longer running."""
        self._is_running = False
        if active := self._active:
            self._finish(active, _call_soon)

    def close(self) -> None:
        """Cancel the active goal, if any, and close the action's topics."""
        self._is_running = False
        self.preempt()
        self._server.stop()

    def _receive(self, handle: ServerGoalHandle) -> None:
        try:
            goal = self._accept(handle.get_goal())
        except Rejection as rejection:
            handle.set_rejected(rejection.result, str(rejection))
            return
        self.preempt()
        # The caller holds the action server's lock, so that the goal's acceptance is reported before its outcome.
        self._active = _Active(handle, goal)
        handle.set_accepted()
        if not self._is_running:
            self.preempt()  # the loop has stopped in the meantime

    def _receive_cancel(self, handle: ServerGoalHandle) -> None:
        active = self._active
        if active is not None and active.handle == handle:
            if active.goal.outcome is None:
                self._cancel()
            self._finish(active, _call)

    def _finish(self, active: _Active, call: Callable[[Callable[[], None]], None]) -> None:
        """Report the outcome of a goal that is ending. A goal without an outcome is reported as cancelled."""
        if self._active is active:
            self._active = None
        active.goal.finish(CANCELLED)
        outcome = active.goal.outcome
        assert outcome is not None
        # Several threads may get here at once; only the first one reports.
        if active.report_once.acquire(blocking=False):
            ends = {
                GoalEvent.SUCCEED: active.handle.set_succeeded,
                GoalEvent.ABORT: active.handle.set_aborted,
                GoalEvent.CANCEL: active.handle.set_canceled,
            }
            call(lambda: ends[outcome.event](self._make_result(outcome)))


@dataclass(eq=False)
class _Active:
    """The active goal of a RealtimeActionServer."""

    handle: ServerGoalHandle
    goal: MonitoredGoal
    due: int | None = None  # ROS time in ns of the next report; None before the first cycle
    # acquired once, by the thread that reports the outcome
    report_once: threading.Lock = field(default_factory=threading.Lock)


def _call(function: Callable[[], None]) -> None:
    function()


def _call_soon(function: Callable[[], None]) -> None:
    """Call a function in the shared sender thread."""
    _sender().put(function)


_lock = threading.Lock()
_queues: list[SimpleQueue[Callable[[], None]]] = []


def _sender() -> SimpleQueue[Callable[[], None]]:
    """Return the queue of the shared sender thread, which starts on first use."""
    if not _queues:
        with _lock:
            if not _queues:
                queue: SimpleQueue[Callable[[], None]] = SimpleQueue()
                threading.Thread(target=_send, args=(queue,), daemon=True, name="realtime publisher").start()
                _queues.append(queue)
    return _queues[0]


def _send(queue: SimpleQueue[Callable[[], None]]) -> None:
    while True:
        function = queue.get()
        # An error on one topic must not end the thread, which serves all topics.
        try:
            function()
        except rospy.ROSException:
            pass  # the node is shutting down
        except Exception as error:  # noqa: BLE001 - a message that cannot be serialized raises anything
            rospy.logerr("a controller's message was not sent: %s", error)
