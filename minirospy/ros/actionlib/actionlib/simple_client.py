"""SimpleActionClient: one goal at a time, with three states and three callbacks.

Source: http://wiki.ros.org/actionlib/DetailedDescription#Client-Side_Policies.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from actionlib_msgs.msg import GoalStatus

from minirospy import client as rospy
from minirospy.base import times
from minirospy.core.graph.goals import SIMPLE_STEPS, SimpleStep, visible_state
from minirospy.core.idl.protocols import Action, Message
from minirospy.ros.actionlib.actionlib.client import ActionClient
from minirospy.ros.actionlib.actionlib.machine import ClientGoalHandle
from minirospy.ros.actionlib.actionlib.states import CommState, SimpleGoalState
from minirospy.ros.actionlib.actionlib.waiting import Waiting

__all__ = ["SimpleActionClient"]

DoneCallback = Callable[[int, Any], object]
FeedbackCallback = Callable[[Any], object]


class SimpleActionClient:
    """A client that tracks one goal at a time: a new goal replaces the previous one.

    ``ns`` is the server's namespace, ``ActionSpec`` the action's class. Raise ActionException if ``ActionSpec`` is not an
    action class.
    """

    def __init__(self, ns: str, ActionSpec: type[Action]) -> None:
        self.action_client = ActionClient(ns, ActionSpec)
        self.simple_state: int = SimpleGoalState.DONE
        self.gh: ClientGoalHandle | None = None
        self.done_cb: DoneCallback | None = None
        self.active_cb: Callable[[], object] | None = None
        self.feedback_cb: FeedbackCallback | None = None
        self._set_simple_state(SimpleGoalState.PENDING)
        # Held while sending a goal: the server may respond before the goal's handle is stored.
        self._lock = threading.RLock()
        self._finished: ClientGoalHandle | None = None
        self._news = Waiting()

    def wait_for_server(self, timeout: times.Duration = rospy.Duration()) -> bool:  # noqa: B008
        """Wait until a server is connected; return False after ``timeout`` (zero Duration: no timeout)."""
        return self.action_client.wait_for_server(timeout)

    def send_goal(
        self,
        goal: Message,
        done_cb: DoneCallback | None = None,
        active_cb: Callable[[], object] | None = None,
        feedback_cb: FeedbackCallback | None = None,
    ) -> None:
        """Send a goal and stop tracking the previous one.

        ``active_cb()`` is called when the server accepts the goal, ``feedback_cb(feedback)`` for each feedback message, and
        ``done_cb(state, result)`` when the goal ends. All are called in the library's threads.
        """
        with self._lock:
            self.stop_tracking_goal()
            self.done_cb = done_cb
            self.active_cb = active_cb
            self.feedback_cb = feedback_cb
            self._set_simple_state(SimpleGoalState.PENDING)
            self.gh = self.action_client.send_goal(goal, self._handle_transition, self._handle_feedback)

    def send_goal_and_wait(
        self,
        goal: Message,
        execute_timeout: times.Duration = rospy.Duration(),  # noqa: B008
        preempt_timeout: times.Duration = rospy.Duration(),  # noqa: B008
    ) -> int:
        """Send a goal, wait until it ends, and return its state.

        After ``execute_timeout``, cancel the goal and wait for up to ``preempt_timeout`` until it ends. A zero Duration
        means no timeout.
        """
        self.send_goal(goal)

        if not self.wait_for_result(execute_timeout):
            rospy.logdebug("Canceling goal")
            self.cancel_goal()
            if self.wait_for_result(preempt_timeout):
                rospy.logdebug(
                    "Preempt finished within specified preempt_timeout [%.2f]", preempt_timeout.to_sec()
                )
            else:
                rospy.logdebug(
                    "Preempt didn't finish specified preempt_timeout [%.2f]", preempt_timeout.to_sec()
                )

        return self.get_state()

    def wait_for_result(self, timeout: times.Duration = rospy.Duration()) -> bool:  # noqa: B008
        """Wait until the goal has ended and its done callback has returned; return False after ``timeout`` (zero: no timeout)."""
        waited_for = self.gh
        if waited_for is None:
            rospy.logerr("Called wait_for_result when no goal exists")
            return False

        def is_over() -> bool:
            # The wait is also over if the done callback or another thread has sent a new goal.
            return (
                self.gh is None or self.simple_state == SimpleGoalState.DONE or self._finished is waited_for
            )

        return self._news.wait_for(is_over, timeout) and self.gh is not None

    def get_result(self) -> Any:
        """Return the goal's result, or None if it has not arrived yet."""
        if self.gh is None:
            rospy.logerr("Called get_result when no goal is running")
            return None
        return self.gh.get_result()

    def get_state(self) -> int:
        """Return the goal's state, a constant from GoalStatus; LOST if there is no goal."""
        gh = self.gh
        return visible_state(gh.get_goal_status()) if gh else GoalStatus.LOST

    def get_goal_status_text(self) -> str:
        """Return the text that the server sent with the state."""
        if self.gh is None:
            rospy.logerr("Called get_goal_status_text when no goal is running")
            return "ERROR: Called get_goal_status_text when no goal is running"
        return self.gh.get_goal_status_text()

    def cancel_all_goals(self) -> None:
        """Send the server a request to cancel all its goals, including those from other clients."""
        self.action_client.cancel_all_goals()

    def cancel_goals_at_and_before_time(self, time: times.Time) -> None:
        """Send the server a request to cancel all goals stamped at or before ``time``, including those from other clients."""
        self.action_client.cancel_goals_at_and_before_time(time)

    def cancel_goal(self) -> None:
        """Send the server a request to cancel the goal."""
        if self.gh:
            self.gh.cancel()

    def stop_tracking_goal(self) -> None:
        """Stop calling the goal's callbacks. The server still executes the goal."""
        self.gh = None
        self._finished = None

    def _handle_transition(self, gh: ClientGoalHandle) -> None:
        comm_state = gh.get_comm_state()

        with self._lock:
            if gh != self.gh:
                rospy.logerr("Got a transition callback on a goal handle that we're not tracking")
                return
            tracked = self.gh
            step = SIMPLE_STEPS[self.simple_state][comm_state]
            done_cb, active_cb = self.done_cb, self.active_cb
            if step is SimpleStep.ACTIVATE:
                self._set_simple_state(SimpleGoalState.ACTIVE)

        if step is SimpleStep.ACTIVATE:
            if active_cb:
                active_cb()
        elif step is SimpleStep.FINISH:
            try:
                if done_cb:
                    done_cb(gh.get_goal_status(), gh.get_result())
            finally:
                self._finish(tracked)
        elif step is SimpleStep.WRONG:
            self._log_wrong(comm_state)

    def _finish(self, tracked: ClientGoalHandle | None) -> None:
        """Wake the threads that wait for the goal, after its done callback has returned."""
        with self._lock:
            self._finished = tracked
            if self.gh is tracked:
                self._set_simple_state(SimpleGoalState.DONE)
        self._news.notify()

    def _log_wrong(self, comm_state: int) -> None:
        if comm_state == CommState.DONE:
            rospy.logerr("SimpleActionClient received DONE twice")
            return
        rospy.logerr(
            "Received comm state %s when in simple state %s with SimpleActionClient in NS %s",
            CommState.to_string(comm_state),
            SimpleGoalState.to_string(self.simple_state),
            rospy.resolve_name(self.action_client.ns),
        )

    def _handle_feedback(self, gh: ClientGoalHandle, feedback: Message) -> None:
        with self._lock:
            tracked, feedback_cb = self.gh, self.feedback_cb
        if tracked is None:
            return
        if gh != tracked:
            rospy.logerr(
                "Got a feedback callback on a goal handle that we're not tracking. %s vs %s",
                *(_goal_id(handle) for handle in (tracked, gh)),
            )
        elif feedback_cb:
            feedback_cb(feedback)

    def _set_simple_state(self, state: int) -> None:
        self.simple_state = state


def _goal_id(handle: ClientGoalHandle) -> str:
    machine = handle.comm_state_machine
    return machine.action_goal.goal_id.id if machine else ""
