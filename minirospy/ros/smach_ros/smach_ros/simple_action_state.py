"""A state that sends a goal to an action server and waits for its result."""

from __future__ import annotations

import copy
import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from actionlib_msgs.msg import GoalStatus

from minirospy import client as rospy
from minirospy.base.clock import SignalSafeEvent
from minirospy.base.times import Duration
from minirospy.core.idl.protocols import Message
from minirospy.ros.actionlib.actionlib.simple_client import SimpleActionClient
from minirospy.ros.smach.smach.exceptions import InvalidStateError
from minirospy.ros.smach.smach.state import State
from minirospy.ros.smach.smach.user_data import Values
from minirospy.ros.smach_ros.smach_ros.callbacks import StateCallback

__all__ = ["SimpleActionState"]

_LOOK = 0.1  # seconds between checks for timeouts and for a shutdown
_MINUTE = rospy.Duration(60.0)


class SimpleActionState(State):
    """A state that sends a goal to an action server and waits for the result.

    Outcomes: "succeeded", "preempted", "aborted" (in all other cases), and the callback's outcomes.
    """

    WAITING_FOR_SERVER = 0
    INACTIVE = 1
    ACTIVE = 2
    PREEMPTING = 3
    COMPLETED = 4

    def __init__(
        self,
        action_name: str,
        action_spec: Any,
        goal: Message | None = None,
        goal_key: str | None = None,
        goal_slots: Sequence[str] = (),
        goal_cb: Callable[..., object] | None = None,
        goal_cb_args: Sequence[object] = (),
        goal_cb_kwargs: Mapping[str, object] | None = None,
        result_key: str | None = None,
        result_slots: Sequence[str] = (),
        result_cb: Callable[..., object] | None = None,
        result_cb_args: Sequence[object] = (),
        result_cb_kwargs: Mapping[str, object] | None = None,
        input_keys: Iterable[str] = (),
        output_keys: Iterable[str] = (),
        outcomes: Iterable[str] = (),
        exec_timeout: rospy.Duration | None = None,
        preempt_timeout: rospy.Duration = _MINUTE,
        server_wait_timeout: rospy.Duration = _MINUTE,
    ) -> None:
        """Create the state.

        The goal is built from ``goal``, from userdata (a whole goal or single fields), and by ``goal_cb``.
        ``goal_cb(userdata, goal)`` may change the goal or return another one. ``result_cb(userdata, status, result)`` may
        return an outcome. ``result_key`` and ``result_slots`` select what is stored in the userdata. A goal is cancelled
        after ``exec_timeout``, and abandoned ``preempt_timeout`` after the cancellation.
        """
        super().__init__(outcomes=["succeeded", "aborted", "preempted"])
        self._action_name = action_name
        self._action_spec = action_spec
        self._exec_timeout = exec_timeout
        self._preempt_timeout = preempt_timeout
        self._server_wait_timeout = server_wait_timeout

        if goal and callable(goal):
            raise InvalidStateError("Goal object given to SimpleActionState that IS a function object")
        spec = action_spec()
        slots = spec.action_goal.goal.__slots__
        if not set(goal_slots) <= set(slots):
            raise InvalidStateError(
                f"Goal slots specified are not valid slots. Available slots: {slots}; specified slots: {goal_slots}"
            )
        self._goal_cb = StateCallback(
            self, "Goal", goal_cb, input_keys, output_keys, goal_cb_args, goal_cb_kwargs
        )
        # As in ROS, the result callback receives no extra arguments.
        self._result_cb = StateCallback(self, "Result", result_cb, input_keys, output_keys)
        if not set(result_slots) <= set(spec.action_result.result.__slots__):
            raise InvalidStateError("Result slots specified are not valid slots.")
        self._goal = copy.copy(spec.action_goal.goal) if goal is None else goal
        self._goal_key, self._goal_slots = goal_key, goal_slots
        self._result_key, self._result_slots = result_key, result_slots

        self._goal_cb.adopt()
        self._result_cb.adopt()
        self.register_input_keys([*input_keys, *goal_slots, *([goal_key] if goal_key else [])])
        self.register_output_keys([*output_keys, *result_slots, *([result_key] if result_key else [])])
        self.register_outcomes(outcomes)

        self._status = SimpleActionState.WAITING_FOR_SERVER
        self._goal_status = 0
        self._goal_result: Message | None = None
        self._duration: Duration = rospy.Duration(0)
        self._activate_time = rospy.Time.now()
        self._done = SignalSafeEvent()
        self._action_client = SimpleActionClient(action_name, action_spec)
        self._action_wait_thread = threading.Thread(
            name=f"{action_name}/wait_for_server", target=self._wait_for_server, daemon=True
        )
        self._action_wait_thread.start()

    def _wait_for_server(self) -> None:
        end = rospy.get_rostime() + self._server_wait_timeout
        while not rospy.is_shutdown() and rospy.get_rostime() < end:
            try:
                if self._action_client.wait_for_server(rospy.Duration(1.0)):
                    self._status = SimpleActionState.INACTIVE
                    return
            except rospy.ROSInterruptException:
                return
            if self.preempt_requested():
                return

    def request_preempt(self) -> None:
        """Preempt the state and cancel its goal."""
        rospy.loginfo(f"Preempt requested on action '{self._action_name}'")
        super().request_preempt()
        if self._status == SimpleActionState.ACTIVE:
            rospy.loginfo(f"Preempt on action '{self._action_name}' cancelling goal: \n{self._goal}")
            self._action_client.cancel_goal()

    def execute(self, ud: Values) -> str:
        """Send the goal, wait for its result and return the outcome."""
        failure = self._connect() or self._make_goal(ud)
        if failure:
            return failure
        self._activate_time = rospy.Time.now()
        self._done.clear()
        self._status = SimpleActionState.ACTIVE
        self._action_client.send_goal(
            self._goal, self._goal_done_cb, self._goal_active_cb, self._goal_feedback_cb
        )
        is_done = self._wait_for_result()
        self._status = SimpleActionState.INACTIVE
        return self._take_result(ud) if is_done else "aborted"

    def _connect(self) -> str | None:
        """Wait for the action server. Return an outcome if it does not become available, otherwise None."""
        if self._status == SimpleActionState.WAITING_FOR_SERVER:
            rospy.logwarn(f"Still waiting for action server '{self._action_name}' to start... is it running?")
            if self._action_wait_thread.is_alive():
                self._action_wait_thread.join()
            else:
                self._wait_for_server()
            if self._status != SimpleActionState.WAITING_FOR_SERVER:
                rospy.loginfo(f"Connected to action server '{self._action_name}'.")
        if self.preempt_requested():
            rospy.loginfo(f"Preempting {self._action_name} before sending goal.")
            self.service_preempt()
            return "preempted"
        if self._status == SimpleActionState.WAITING_FOR_SERVER:
            rospy.logfatal(f"Action server for {self._action_name} is not running.")
            return "aborted"
        return None

    def _make_goal(self, ud: Values) -> str | None:
        """Build the goal. Return an outcome if that fails, otherwise None."""
        if self._goal_key is not None:
            self._goal = ud[self._goal_key]
        for key in self._goal_slots:
            setattr(self._goal, key, ud[key])
        is_fine, changed = self._goal_cb(ud, self._goal)
        if not is_fine:
            return "aborted"
        if changed is not None:
            self._goal = changed
        return None

    def _wait_for_result(self) -> bool:
        """Return whether a result has arrived; after the timeout, cancel the goal."""
        cancelled: rospy.Time | None = None

        while not self._done.wait(_LOOK):
            if rospy.is_shutdown():
                return False
            now = rospy.Time.now()
            if cancelled is not None:
                if now - cancelled > self._preempt_timeout:
                    rospy.logerr(
                        f"Action {self._action_name} did not end within {self._preempt_timeout.to_sec():g} seconds after its "
                        "goal was cancelled."
                    )
                    return False
            elif self.preempt_requested():
                # Cancel the goal here, too: the preemption may have been requested just before the goal was sent.
                self._action_client.cancel_goal()
                cancelled = now
            elif self._exec_timeout and now - self._activate_time > self._exec_timeout:
                rospy.logwarn(
                    f"Action {self._action_name} timed out after {int(self._exec_timeout.to_sec())} seconds."
                )
                self._action_client.cancel_goal()
                cancelled = now
        return True

    def _take_result(self, ud: Values) -> str:
        is_fine, outcome = self._result_cb(ud, self._goal_status, self._goal_result)
        if not is_fine:
            return "aborted"
        if outcome is not None and outcome not in self.get_registered_outcomes():
            rospy.logerr(
                f"Result callback for action {self._action_name}, {self._result_cb} was not registered with the "
                f"result_cb_outcomes argument. The result callback returned '{outcome}' but the only registered outcomes "
                f"are: {self.get_registered_outcomes()}"
            )
            return "aborted"

        if self._result_key is not None:
            ud[self._result_key] = self._goal_result
        # A lost goal has no result.
        if self._goal_result is not None:
            for key in self._result_slots:
                ud[key] = getattr(self._goal_result, key)
        ending = self._ending()
        return ending if outcome is None else str(outcome)

    def _ending(self) -> str:
        if self._goal_status == GoalStatus.SUCCEEDED:
            return "succeeded"
        if self._goal_status == GoalStatus.PREEMPTED and self.preempt_requested():
            self.service_preempt()
            return "preempted"
        return "aborted"

    def _goal_active_cb(self) -> None:
        rospy.logdebug(f"Action {self._action_name} has gone active.")

    def _goal_feedback_cb(self, feedback: Message) -> None:
        rospy.logdebug(f"Action {self._action_name} sent feedback.")

    def _goal_done_cb(self, result_state: int, result: Message) -> None:
        self._duration = rospy.Time.now() - self._activate_time
        self._goal_status, self._goal_result = result_state, result
        self._done.set()
