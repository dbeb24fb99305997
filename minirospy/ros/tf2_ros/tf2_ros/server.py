"""tf2_ros.BufferServer: looks up transforms for BufferClients through an action. Source: http://wiki.ros.org/tf2_ros."""

from __future__ import annotations

import threading

from tf2_msgs.msg import LookupTransformAction, LookupTransformGoal, LookupTransformResult, TF2Error

from minirospy import client as rospy
from minirospy.base import times
from minirospy.base.clock import SignalSafeEvent, wait_for_event
from minirospy.base.errors import (
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    TimeoutException,
    TransformException,
)
from minirospy.ros.actionlib import actionlib
from minirospy.ros.tf2_ros.tf2_ros.buffer import Buffer
from minirospy.runtime.transport.limits import naming_thread_limit

__all__ = ["BufferServer"]

_CHECK_PERIOD = times.Duration(0, 10_000_000)
_CODES: list[tuple[type[TransformException], int]] = [
    (ConnectivityException, TF2Error.CONNECTIVITY_ERROR),
    (LookupException, TF2Error.LOOKUP_ERROR),
    (ExtrapolationException, TF2Error.EXTRAPOLATION_ERROR),
    (InvalidArgumentException, TF2Error.INVALID_ARGUMENT_ERROR),
    (TimeoutException, TF2Error.TIMEOUT_ERROR),
    (TransformException, TF2Error.TRANSFORM_ERROR),
]


class BufferServer:
    """An action server named ``ns`` (tf2_msgs/LookupTransform) that completes each goal as soon as ``buffer`` can look it up.

    A goal stays pending until an insertion makes its lookup possible, or its timeout expires and the result contains the
    error. ``check_period`` (a Duration) is the interval at which simulated time is checked. Real ROS has this class only
    in C++.
    """

    def __init__(
        self,
        buffer: Buffer,
        ns: str,
        auto_start: bool = False,
        check_period: times.Duration = _CHECK_PERIOD,
    ) -> None:
        self.buffer = buffer
        self._check_seconds = check_period.to_sec()
        self._lock = threading.Lock()
        self._pending: list[tuple[actionlib.ServerGoalHandle, times.Time]] = []
        """The pending goals, with their deadlines."""
        self._news = SignalSafeEvent()
        self._server = actionlib.ActionServer(
            ns, LookupTransformAction, self._take_goal, self._cancel, auto_start=False
        )
        if auto_start:
            self.start()

    def start(self) -> None:
        """Accept goals until the node shuts down."""
        self.buffer.on_change(self._news.set)
        with naming_thread_limit():
            threading.Thread(target=self._work, name="buffer server", daemon=True).start()
        self._server.start()

    def _take_goal(self, handle: actionlib.ServerGoalHandle) -> None:
        handle.set_accepted("goal accepted")
        goal: LookupTransformGoal = handle.get_goal()
        end = rospy.get_rostime() + goal.timeout
        if goal.timeout.to_nsec() <= 0 or self._is_possible(goal):
            handle.set_succeeded(self._result(goal))
            return
        with self._lock:
            self._pending.append((handle, end))
        self._news.set()

    def _cancel(self, handle: actionlib.ServerGoalHandle) -> None:
        with self._lock:
            mine = [each for each in self._pending if each[0] == handle]
            for each in mine:
                self._pending.remove(each)
        if mine:
            handle.set_canceled()

    def _work(self) -> None:
        """Complete the goals that are due, after each inserted transform and at each goal's timeout."""
        with rospy.interrupting(self._news.set):
            while not rospy.is_down():
                self._news.clear()
                for handle in self._due():
                    handle.set_succeeded(self._result(handle.get_goal()))
                wait_for_event(self._news, self._next_look())

    def _due(self) -> list[actionlib.ServerGoalHandle]:
        """Remove and return the goals whose transform is available or whose timeout has passed."""
        now = rospy.get_rostime()
        with self._lock:
            waiting, self._pending = self._pending, []
            due = []
            for handle, end in waiting:
                if end <= now or self._is_possible(handle.get_goal()):
                    due.append(handle)
                else:
                    self._pending.append((handle, end))
        return due

    def _next_look(self) -> float | None:
        with self._lock:
            ends = [end for _, end in self._pending]
        if not ends:
            return None
        if not rospy.is_wallclock():
            return self._check_seconds
        return max(0.0, (min(ends) - rospy.get_rostime()).to_sec())

    def _is_possible(self, goal: LookupTransformGoal) -> bool:
        if goal.advanced:
            return bool(
                self.buffer.can_transform_full_core(
                    goal.target_frame, goal.target_time, goal.source_frame, goal.source_time, goal.fixed_frame
                )[0]
            )
        return bool(self.buffer.can_transform_core(goal.target_frame, goal.source_frame, goal.source_time)[0])

    def _result(self, goal: LookupTransformGoal) -> LookupTransformResult:
        result = LookupTransformResult()
        try:
            if goal.advanced:
                result.transform = self.buffer.lookup_transform_full_core(
                    goal.target_frame, goal.target_time, goal.source_frame, goal.source_time, goal.fixed_frame
                )
            else:
                result.transform = self.buffer.lookup_transform_core(
                    goal.target_frame, goal.source_frame, goal.source_time
                )
        except TransformException as error:
            code = next(code for kind, code in _CODES if isinstance(error, kind))
            result.error = TF2Error(code, str(error))
        return result
