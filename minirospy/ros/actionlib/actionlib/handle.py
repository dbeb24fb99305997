"""The server's goals: one StatusTracker per goal, and ServerGoalHandles for user code.

The transitions are a table in `minirospy.core.graph.goals`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol, cast

from actionlib_msgs.msg import GoalID, GoalStatus

from minirospy import client as rospy
from minirospy.base import times
from minirospy.core.graph.goals import SERVER_STEPS, TERMINAL, GoalEvent
from minirospy.ros.actionlib.actionlib.goal_id import GoalIDGenerator
from minirospy.ros.actionlib.actionlib.statuses import status_bytes

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

    from minirospy.core.idl.protocols import ActionGoal, Message

__all__ = ["HandleTrackerDeleter", "ServerGoalHandle", "StatusTracker"]

_NOTHING = times.Time()
_WHERE_FROM = {
    GoalEvent.ACCEPT: "a pending or recalling state",
    GoalEvent.CANCEL: "a pending, recalling, active, or preempting state",
    GoalEvent.REJECT: "a pending or recalling state",
    GoalEvent.ABORT: "a preempting or active state",
    GoalEvent.SUCCEED: "a preempting or active state",
}


class StatusTracker:
    """Tracks the status of a goal or, if ``goal`` is None, of a goal that was cancelled before it arrived."""

    def __init__(
        self, goal_id: GoalID | None = None, status: int | None = None, goal: ActionGoal | None = None
    ) -> None:
        self.goal = goal
        self.handle_tracker: HandleTrackerDeleter | None = None
        self.id_generator = GoalIDGenerator()
        self.ended_at = 0  # time at which the goal ended, in ns of ROS time; 0 until then
        self._bytes: bytes | None = None
        self._serialized: tuple[object, ...] = ()  # the field values from which `_bytes` was made
        self.status = GoalStatus()
        if goal is None:
            self.status.goal_id = goal_id or GoalID()
            self.status.status = status or GoalStatus.PENDING
        elif goal.goal_id.id:
            self.status.goal_id = cast("GoalID", goal.goal_id)
            if self.status.goal_id.stamp == _NOTHING:
                self.status.goal_id.stamp = rospy.Time.now()
        else:
            self.status.goal_id = self.id_generator.generate_ID()

    @property
    def handle_destruction_time(self) -> times.Time:
        """Return the time at which the goal ended, or zero if it has not ended."""
        return rospy.Time(nsecs=self.ended_at)

    @handle_destruction_time.setter
    def handle_destruction_time(self, time: times.Time) -> None:
        self.ended_at = time.to_nsec()

    def end(self) -> None:
        """Record that the goal has ended. Its status is removed from the list after the status list timeout."""
        self.ended_at = rospy.Time.now().to_nsec()
        self._bytes = None

    def serialize(self) -> bytes:
        """Serialize the status. Once the goal has ended, cache the bytes, because the status then rarely changes."""
        if not self.ended_at:
            return status_bytes(self.status)
        status = self.status
        id, stamp = status.goal_id.id, status.goal_id.stamp
        values = (status.status, status.text, id, stamp.secs, stamp.nsecs)
        if self._bytes is None or self._serialized != values:
            self._bytes, self._serialized = status_bytes(status), values
        return self._bytes


class _Server(Protocol):
    """The action server methods that goal handles call."""

    ActionResultType: type[Message]

    @property
    def lock(self) -> AbstractContextManager[object]: ...

    def publish_status(self) -> None: ...

    def publish_feedback(self, status: GoalStatus, feedback: Message) -> None: ...

    def publish_result(self, status: GoalStatus, result: Message | None) -> None: ...


class HandleTrackerDeleter:
    """A callable that marks a goal as ended."""

    def __init__(self, action_server: _Server, status_tracker: StatusTracker) -> None:
        self.action_server = action_server
        self.status_tracker: StatusTracker | None = status_tracker

    def __call__(self, ptr: object) -> None:
        if self.status_tracker:
            with self.action_server.lock:
                self.status_tracker.end()


class ServerGoalHandle:
    """A goal received by a server. A handle created without arguments has no goal, and its methods log an error."""

    def __init__(
        self,
        status_tracker: StatusTracker | None = None,
        action_server: _Server | None = None,
        handle_tracker: HandleTrackerDeleter | None = None,
    ) -> None:
        self.status_tracker = status_tracker
        self.action_server = action_server
        self.handle_tracker = handle_tracker
        self.goal = status_tracker.goal if status_tracker else None

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, ServerGoalHandle):
            return NotImplemented if other is not None else False
        if not self.goal or not other.goal:
            return False
        return bool(self.get_goal_id().id == other.get_goal_id().id)

    def __ne__(self, other: object) -> bool:
        return not self == other

    def __hash__(self) -> int:
        return hash(self.get_goal_id().id)

    def get_default_result(self) -> Message | None:
        """Return an empty result."""
        return self.action_server.ActionResultType() if self.action_server else None

    def set_accepted(self, text: str = "") -> None:
        """Accept the goal."""
        self._log("Accepting goal, id: %s, stamp: %.2f")
        if self._step(GoalEvent.ACCEPT, text) and self.action_server:
            self.action_server.publish_status()

    def set_canceled(self, result: Message | None = None, text: str = "") -> None:
        """Set the goal's status after a cancel request: RECALLED if the goal was never accepted, otherwise PREEMPTED."""
        self._log("Setting status to canceled on goal, id: %s, stamp: %.2f")
        self._finish(GoalEvent.CANCEL, result, text)

    def set_rejected(self, result: Message | None = None, text: str = "") -> None:
        """Reject the goal."""
        self._log("Setting status to rejected on goal, id: %s, stamp: %.2f")
        self._finish(GoalEvent.REJECT, result, text)

    def set_aborted(self, result: Message | None = None, text: str = "") -> None:
        """Set the goal's status to ABORTED."""
        self._log("Setting status to aborted on goal, id: %s, stamp: %.2f")
        self._finish(GoalEvent.ABORT, result, text)

    def set_succeeded(self, result: Message | None = None, text: str = "") -> None:
        """Set the goal's status to SUCCEEDED."""
        self._log("Setting status to succeeded on goal, id: %s, stamp: %.2f")
        self._finish(GoalEvent.SUCCEED, result, text)

    def set_cancel_requested(self) -> bool:
        """Record a client's cancel request; return whether it changes the goal's state."""
        self._log("Transisitoning to a cancel requested state on goal id: %s, stamp: %.2f")
        tracker = self.status_tracker
        if not self.goal or tracker is None or self.action_server is None:
            return False
        with self.action_server.lock:
            state = SERVER_STEPS[GoalEvent.CANCEL_REQUEST].get(tracker.status.status)
            if state is None:
                return False
            tracker.status.status = int(state)
            self.action_server.publish_status()
            return True

    def publish_feedback(self, feedback: Message) -> None:
        """Send feedback to the goal's client."""
        self._log("Publishing feedback for goal, id: %s, stamp: %.2f")
        if not self.goal or self.status_tracker is None or self.action_server is None:
            rospy.logerr("Attempt to publish feedback on an uninitialized ServerGoalHandle")
            return
        with self.action_server.lock:
            self.action_server.publish_feedback(self.status_tracker.status, feedback)

    def get_goal(self) -> Any:
        """Return the goal, or None if the handle has no goal."""
        return self.goal.goal if self.goal else None

    def get_goal_id(self) -> GoalID:
        """Return the goal's ID and stamp."""
        if not self.goal or self.status_tracker is None:
            rospy.logerr("Attempt to get a goal id on an uninitialized ServerGoalHandle")
            return GoalID()
        return self.status_tracker.status.goal_id

    def get_goal_status(self) -> GoalStatus:
        """Return the goal's status and text."""
        if not self.goal or self.status_tracker is None:
            rospy.logerr("Attempt to get goal status on an uninitialized ServerGoalHandle")
            return GoalStatus()
        return self.status_tracker.status

    def _log(self, line: str) -> None:
        goal_id = self.get_goal_id()
        rospy.logdebug(line, goal_id.id, goal_id.stamp.to_sec())

    def _step(self, event: GoalEvent, text: str) -> bool:
        """Apply an event to the goal's state; log an error if the state does not allow it."""
        tracker = self.status_tracker
        if not self.goal or tracker is None or self.action_server is None:
            rospy.logerr("Attempt to set status on an uninitialized ServerGoalHandle")
            return False
        with self.action_server.lock:
            state = SERVER_STEPS[event].get(tracker.status.status)
            if state is None:
                rospy.logerr(
                    "To transition to %s, the goal must be in %s, it is currently in state: %s",
                    event.value,
                    _WHERE_FROM[event],
                    tracker.status.status,
                )
                return False
            tracker.status.status = int(state)
            tracker.status.text = text
            return True

    def _finish(self, event: GoalEvent, result: Message | None, text: str) -> None:
        server, tracker = self.action_server, self.status_tracker
        if server is None or tracker is None:
            self._step(event, text)
            return
        with server.lock:
            if self._step(event, text) and tracker.status.status in TERMINAL:
                server.publish_result(tracker.status, result or self.get_default_result())
                tracker.end()
