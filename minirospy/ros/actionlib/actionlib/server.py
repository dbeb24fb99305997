"""ActionServer: receives goals and cancel requests, tracks each goal's status, publishes statuses, feedback and results.

Source: http://wiki.ros.org/actionlib/DetailedDescription.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import TypeVar

from actionlib_msgs.msg import GoalID, GoalStatus

from minirospy import client as rospy
from minirospy.base import times
from minirospy.base.clock import SignalSafeEvent
from minirospy.core.graph.goals import is_meant
from minirospy.core.idl.protocols import Action, ActionFeedback, ActionGoal, ActionResult, Message
from minirospy.ros.actionlib.actionlib.goal_id import GoalIDGenerator
from minirospy.ros.actionlib.actionlib.handle import HandleTrackerDeleter, ServerGoalHandle, StatusTracker
from minirospy.ros.actionlib.actionlib.spec import (
    CANCEL_SECONDS,
    SEND_SECONDS,
    TAKES_FAST_ANSWERS,
    ActionException,
    action_types,
)
from minirospy.ros.actionlib.actionlib.statuses import StatusList
from minirospy.runtime.transport.limits import naming_thread_limit

__all__ = ["ActionServer", "nop_cb"]

GoalCallback = Callable[[ServerGoalHandle], object]

_NOTHING = times.Time()
_AUTO_START = (
    "You've passed in true for auto_start to the python action server, you should always pass in false "
    "to avoid race conditions."
)
_TOO_LATE = (
    "This goal handle was canceled by the action server because its timestamp is before the timestamp of "
    "the last cancel request"
)
_FEW_STATUSES = 50  # maximum length of a status list that is published immediately after each change

# Seconds to pause per status after publishing a longer list, so that publishing does not use all CPU time.
_SECONDS_A_STATUS = 1e-4


def nop_cb(goal_handle: ServerGoalHandle) -> None:
    """Do nothing: the default cancel callback."""


_M = TypeVar("_M", bound=Message)


class ActionServer:
    """A server for the action ``ActionSpec`` in the namespace ``ns``.

    ``goal_cb(handle)`` is called with each new goal, ``cancel_cb(handle)`` with each goal that a client cancels. They
    are called in the library's threads, never concurrently. Parameters: ``actionlib_status_frequency`` in Hz,
    ``<ns>/status_list_timeout`` in seconds (how long a goal's status is published after the goal has ended),
    ``actionlib_server_pub_queue_size``, ``actionlib_server_sub_queue_size``. Raise ActionException if ``ActionSpec`` is not
    an action class.
    """

    def __init__(
        self,
        ns: str,
        ActionSpec: type[Action],
        goal_cb: GoalCallback | None,
        cancel_cb: GoalCallback = nop_cb,
        auto_start: bool = True,
    ) -> None:
        types = action_types(ActionSpec)
        if goal_cb is None:
            raise ActionException(f"ActionServer '{ns}' needs a goal callback")
        self.ns = ns
        self.ActionSpec = ActionSpec
        self.ActionGoal = types.action_goal
        self.ActionResult = types.action_result
        self.ActionResultType = types.result
        self.ActionFeedback = types.action_feedback

        self.goal_sub: rospy.Subscriber[ActionGoal] | None = None
        self.cancel_sub: rospy.Subscriber[GoalID] | None = None
        self.status_pub: rospy.Publisher[StatusList] | None = None
        self.result_pub: rospy.Publisher[ActionResult] | None = None
        self.feedback_pub: rospy.Publisher[ActionFeedback] | None = None

        self.lock = threading.RLock()
        self.last_cancel: times.Time = rospy.Time()
        self.status_list_timeout = rospy.Duration()
        self.status_frequency = 5.0
        self.id_generator = GoalIDGenerator()
        self.goal_callback = goal_cb
        self.cancel_callback = cancel_cb
        self.auto_start = auto_start
        self.started = False

        # all goals whose status is published; programs modify this list
        self.status_list: list[StatusTracker] = []
        self._indexed: list[StatusTracker] = []  # the content of `status_list` when `_by_id` was built
        self._by_id: dict[str, StatusTracker] = {}
        self._published_at = 0.0
        self._status_thread: _StatusThread | None = None

        if auto_start:
            self.warn_of_auto_start()
            self.start()

    @staticmethod
    def warn_of_auto_start() -> None:
        """Warn that auto_start can deliver goals before the constructor has returned."""
        rospy.logwarn(_AUTO_START)

    def register_goal_callback(self, cb: GoalCallback) -> None:
        """Set the callback for new goals."""
        self.goal_callback = cb

    def register_cancel_callback(self, cancel_cb: GoalCallback) -> None:
        """Set the callback for cancel requests."""
        self.cancel_callback = cancel_cb

    def start(self) -> None:
        """Start accepting goals."""
        with self.lock:
            if self.started:
                self.stop()
            self.initialize()
            self.started = True
            self.publish_status()

    def stop(self) -> None:
        """Unregister from the action's topics; :meth:`start` registers again."""
        with self.lock:
            self.started = False
            if self._status_thread:
                self._status_thread.stop()
                self._status_thread = None
            for end in (self.goal_sub, self.cancel_sub, self.status_pub, self.result_pub, self.feedback_pub):
                if end:
                    end.unregister()

    def initialize(self) -> None:
        """Read the parameters and create the publishers and subscribers."""
        name = rospy.remap_name(self.ns)
        self.pub_queue_size: int = rospy.get_param("actionlib_server_pub_queue_size", 50)
        if self.pub_queue_size < 0:
            self.pub_queue_size = 50
        # Disable Nagle's algorithm: it delays a small message until the previous one is acknowledged.
        self.status_pub = rospy.Publisher(
            name + "/status", StatusList, latch=True, tcp_nodelay=True, queue_size=self.pub_queue_size
        )
        self.result_pub = rospy.Publisher(
            name + "/result", self.ActionResult, tcp_nodelay=True, queue_size=self.pub_queue_size
        )
        self.feedback_pub = rospy.Publisher(
            name + "/feedback", self.ActionFeedback, tcp_nodelay=True, queue_size=self.pub_queue_size
        )
        self.sub_queue_size: int | None = rospy.get_param("actionlib_server_sub_queue_size", -1)
        if self.sub_queue_size is not None and self.sub_queue_size < 0:
            self.sub_queue_size = None
        self.status_frequency = _status_frequency(name)
        self.status_list_timeout = rospy.Duration.from_sec(
            rospy.get_param(name + "/status_list_timeout", 5.0)
        )
        self.goal_sub = rospy.Subscriber(
            name + "/goal",
            self.ActionGoal,
            callback=self.internal_goal_callback,
            queue_size=self.sub_queue_size,
            tcp_nodelay=True,
        )

        self.cancel_sub = rospy.Subscriber(
            name + "/cancel",
            GoalID,
            callback=self.internal_cancel_callback,
            queue_size=self.sub_queue_size,
            tcp_nodelay=True,
        )

        self._status_thread = _StatusThread(self._publish_periodically, 1.0 / self.status_frequency)

    def publish_result(self, status: GoalStatus, result: Message | None) -> None:
        """Publish a goal's result, then all statuses."""
        with self.lock:
            message = self.ActionResult(status=status, result=result)
            message.header.stamp = rospy.Time.now()
            self._publish(self.result_pub, message)
            self.publish_status()

    def publish_feedback(self, status: GoalStatus, feedback: Message) -> None:
        """Publish feedback on a goal."""
        with self.lock:
            message = self.ActionFeedback(status=status, feedback=feedback)
            message.header.stamp = rospy.Time.now()
            self._publish(self.feedback_pub, message)

    def publish_status(self) -> None:
        """Publish all goals' statuses: immediately if the list is short, otherwise after a pause."""
        with self.lock:
            pause = len(self.status_list) * _SECONDS_A_STATUS
            now = time.monotonic()
            if len(self.status_list) <= _FEW_STATUSES or now - self._published_at >= pause:
                self.publish_status_now()
            elif self._status_thread:
                self._status_thread.hurry(self._published_at + pause - now)

    def publish_status_now(self) -> None:
        """Remove goals that ended longer ago than the status list timeout, then publish all statuses."""
        with self.lock:
            now = rospy.get_rostime()
            self._forget_old(now)
            message = StatusList([tracker.serialize() for tracker in self.status_list])
            message.header.stamp = now
            self._published_at = time.monotonic()
            self._publish(self.status_pub, message)

    def internal_cancel_callback(self, goal_id: GoalID) -> None:
        """Process a cancel request: for one goal ID, for all goals up to a timestamp, or for all goals."""
        time.sleep(CANCEL_SECONDS)

        with self.lock:
            if not self.started:
                return
            rospy.logdebug("The action server has received a new cancel request")
            stamp = goal_id.stamp.to_nsec()

            for tracker in tuple(self.status_list):
                own = tracker.status.goal_id
                if not tracker.goal or not is_meant(goal_id.id, stamp, own.id, own.stamp.to_nsec()):
                    continue
                handle = self._handle(tracker)
                if handle.set_cancel_requested():
                    self.cancel_callback(handle)

            if goal_id.id and self._find(goal_id.id) is None:
                # Store the request, so that the goal is recalled immediately if it arrives later.
                tracker = StatusTracker(goal_id, GoalStatus.RECALLING)
                self._add(tracker)
                tracker.end()

            self.last_cancel = max(self.last_cancel, goal_id.stamp)

    def internal_goal_callback(self, goal: ActionGoal) -> None:
        """Process a goal from a client."""
        header = getattr(goal, "_connection_header", None) or {}
        if not TAKES_FAST_ANSWERS.items() <= header.items():
            time.sleep(SEND_SECONDS)

        with self.lock:
            if not self.started:
                return
            rospy.logdebug("The action server has received a new goal request")
            known = self._find(goal.goal_id.id)
            if known is not None:
                self._meet_again(known)
                return
            tracker = StatusTracker(None, None, goal)
            self._add(tracker)
            handle = self._handle(tracker)
            stamp = goal.goal_id.stamp
            if stamp != _NOTHING and stamp <= self.last_cancel:
                handle.set_canceled(None, _TOO_LATE)
            else:
                self.goal_callback(handle)

    def _meet_again(self, tracker: StatusTracker) -> None:
        """Process a goal with a known ID: it was sent twice, or cancelled before it arrived."""
        status = tracker.status
        rospy.logdebug(
            "Goal %s was already in the status list with status %i", status.goal_id.id, status.status
        )
        if tracker.ended_at:
            tracker.end()
        if status.status == GoalStatus.RECALLING:
            status.status = GoalStatus.RECALLED
            self.publish_result(status, self.ActionResultType())

    def _handle(self, tracker: StatusTracker) -> ServerGoalHandle:
        if tracker.handle_tracker is None:
            tracker.handle_tracker = HandleTrackerDeleter(self, tracker)
        return ServerGoalHandle(tracker, self, tracker.handle_tracker)

    def _publish_periodically(self) -> None:
        # A subclass that overrides publish_status() expects every publication to go through that method.
        if type(self).publish_status is ActionServer.publish_status:
            self.publish_status_now()
        else:
            self.publish_status()

    def _find(self, id: str) -> StatusTracker | None:
        """Return the goal in the list with this ID, or None."""
        # Comparing the lists is fast, because Python first compares the items' identity.
        if self._indexed != self.status_list:
            self._indexed = list(self.status_list)
            self._by_id = {tracker.status.goal_id.id: tracker for tracker in reversed(self._indexed)}
        return self._by_id.get(id)

    def _add(self, tracker: StatusTracker) -> None:
        self.status_list.append(tracker)
        self._indexed.append(tracker)
        self._by_id.setdefault(tracker.status.goal_id.id, tracker)

    def _forget_old(self, now: times.Time) -> None:
        limit = now.to_nsec() - self.status_list_timeout.to_nsec()
        old = [tracker for tracker in self.status_list if 0 < tracker.ended_at < limit]
        if not old:
            return
        gone = set(old)
        self.status_list[:] = [tracker for tracker in self.status_list if tracker not in gone]
        for tracker in old:
            rospy.logdebug(
                "Item %s with destruction time of %.3f being removed from list.  Now = %.3f",
                tracker.status.goal_id,
                tracker.handle_destruction_time.to_sec(),
                now.to_sec(),
            )

    @staticmethod
    def _publish(publisher: rospy.Publisher[_M] | None, message: _M) -> None:
        if publisher and publisher.impl and not rospy.is_down():
            publisher.publish(message)


class _StatusThread:
    """A thread that calls ``publish`` every ``period`` seconds, or sooner on request."""

    def __init__(self, publish: Callable[[], None], period: float) -> None:
        self._publish = publish
        self._period = period
        self._due = time.monotonic() + period
        self._stopped = False
        self._wake = SignalSafeEvent()
        with naming_thread_limit():
            threading.Thread(target=self._run, name="minirospy-action-status", daemon=True).start()

    def hurry(self, seconds: float) -> None:
        """Call ``publish`` after ``seconds``, unless a call is due earlier."""
        due = time.monotonic() + seconds
        if due < self._due:
            self._due = due
            self._wake.set()

    def stop(self) -> None:
        """Stop the thread."""
        self._stopped = True
        self._wake.set()

    def _run(self) -> None:
        with rospy.interrupting(self.stop):
            while not self._stopped:
                if self._wake.wait(max(0.0, self._due - time.monotonic())):
                    self._wake.clear()
                else:
                    self._due = time.monotonic() + self._period
                    self._publish()


def _status_frequency(name: str) -> float:
    """Return how often to publish all statuses, in Hz.

    Raise ActionException if the parameter is not a number above 0.
    """
    if rospy.has_param(name + "/status_frequency"):
        rospy.logwarn(
            "You're using the deprecated status_frequency parameter, please switch to "
            "actionlib_status_frequency."
        )
        found: str | None = name + "/status_frequency"
    else:
        found = rospy.search_param("actionlib_status_frequency")
    frequency = rospy.get_param(found, 5.0) if found else 5.0
    if not isinstance(frequency, (int, float)) or frequency <= 0:
        raise ActionException(f"parameter {found} must be a number of Hz above 0, not {frequency!r}")
    return frequency
