"""The client's goals: one CommStateMachine per goal, owned by the GoalManager and read through a ClientGoalHandle.

The transitions are tables in `minirospy.core.graph.goals`. Source: http://wiki.ros.org/actionlib/DetailedDescription.
"""

from __future__ import annotations

import itertools
import threading
import weakref
from collections.abc import Callable
from typing import Any

from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray

from minirospy import client as rospy
from minirospy.client.session import current_session
from minirospy.core.graph.goals import TERMINAL, client_steps
from minirospy.core.idl.protocols import Action, ActionFeedback, ActionGoal, ActionResult, Message
from minirospy.core.idl.protocols import GoalStatus as AnyGoalStatus
from minirospy.ros.actionlib.actionlib.spec import action_types
from minirospy.ros.actionlib.actionlib.states import CommState, TerminalState, get_name_of_constant
from minirospy.ros.actionlib.actionlib.statuses import find_status

__all__ = ["ClientGoalHandle", "CommStateMachine", "GoalManager"]

TransitionCallback = Callable[["ClientGoalHandle"], object]
FeedbackCallback = Callable[["ClientGoalHandle", Any], object]

_DONE = CommState.DONE
_MAY_BE_MISSING = (CommState.WAITING_FOR_GOAL_ACK, CommState.WAITING_FOR_RESULT, CommState.DONE)
"""States in which the server may not list the goal: not yet, or no longer."""


class ClientGoalHandle:
    """A handle for a sent goal. The goal's callbacks are called only while a handle exists."""

    def __init__(self, comm_state_machine: CommStateMachine) -> None:
        self.comm_state_machine: CommStateMachine | None = comm_state_machine

    def __eq__(self, o: object) -> bool:
        if not isinstance(o, ClientGoalHandle):
            return NotImplemented
        return self.comm_state_machine == o.comm_state_machine

    def __ne__(self, o: object) -> bool:
        return not self == o

    def __hash__(self) -> int:
        return hash(self.comm_state_machine)

    def cancel(self) -> None:
        """Send the server a request to cancel this goal."""
        machine = self._machine("cancel")
        if machine is None:
            return
        with machine.mutex:
            machine.send_cancel_fn(GoalID(id=machine.action_goal.goal_id.id))
            # The server does not acknowledge a cancel request for a goal that has ended, so do not wait for that.
            if machine.state != _DONE:
                machine.transition_to(CommState.WAITING_FOR_CANCEL_ACK)

    def get_comm_state(self) -> int:
        """Return the goal's communication state, a constant from CommState."""
        machine = self._machine("get_comm_state")
        return machine.state if machine else CommState.LOST

    def get_goal_status(self) -> int:
        """Return the goal's last status, a constant from GoalStatus."""
        machine = self._machine("get_goal_status")
        return machine.latest_goal_status.status if machine else GoalStatus.PENDING

    def get_goal_status_text(self) -> str:
        """Return the text that the server sent with the last status."""
        machine = self._machine("get_goal_status_text")
        if machine is None:
            return "ERROR: Trying to get_goal_status_text on an inactive ClientGoalHandle."
        return machine.latest_goal_status.text

    def get_result(self) -> Any:
        """Return the goal's result, or None if it has not arrived yet."""
        machine = self._machine("get_result")
        return machine.latest_result.result if machine and machine.latest_result else None

    def get_terminal_state(self) -> int:
        """Return the goal's final state, a constant from TerminalState.

        If the goal has not ended, log an error and return LOST.
        """
        machine = self._machine("get_terminal_state")
        if machine is None:
            return TerminalState.LOST
        with machine.mutex:
            if machine.state != _DONE:
                rospy.logwarn(
                    "Asking for the terminal state when we're in [%s]", CommState.to_string(machine.state)
                )
            status = machine.latest_goal_status.status
            if status in TERMINAL:
                return status
            rospy.logerr("Asking for a terminal state, but the goal status is %d", status)
            return TerminalState.LOST

    def _machine(self, call: str) -> CommStateMachine | None:
        if self.comm_state_machine is None:
            rospy.logerr("Trying to %s on an inactive ClientGoalHandle.", call)
        return self.comm_state_machine


class CommStateMachine:
    """Tracks a goal for its client: processes the server's messages and calls the callback on each state change.

    ``mutex`` is held during callbacks, so the callbacks for one goal never run concurrently.
    """

    def __init__(
        self,
        action_goal: ActionGoal,
        transition_cb: TransitionCallback | None,
        feedback_cb: FeedbackCallback | None,
        send_goal_fn: Callable[[ActionGoal], object] | None,
        send_cancel_fn: Callable[[GoalID], object],
    ) -> None:
        self.action_goal = action_goal
        self.transition_cb = transition_cb
        self.feedback_cb = feedback_cb
        self.send_goal_fn = send_goal_fn
        self.send_cancel_fn = send_cancel_fn
        self.state: int = CommState.WAITING_FOR_GOAL_ACK
        self.mutex = threading.RLock()
        self.latest_goal_status: AnyGoalStatus = GoalStatus(status=GoalStatus.PENDING)
        self.latest_result: ActionResult | None = None

    def __eq__(self, o: object) -> bool:
        if not isinstance(o, CommStateMachine):
            return NotImplemented
        return bool(self.action_goal.goal_id.id == o.action_goal.goal_id.id)

    def __hash__(self) -> int:
        return hash(self.action_goal.goal_id.id)

    def set_state(self, state: int) -> None:
        """Set the state without calling the callback."""
        rospy.logdebug(
            "Transitioning CommState from %s to %s",
            CommState.to_string(self.state),
            CommState.to_string(state),
        )
        self.state = state

    def transition_to(self, state: int) -> None:
        """Set the state and call the callback."""
        rospy.logdebug(
            "Transitioning to %s (from %s, goal: %s)",
            CommState.to_string(state),
            CommState.to_string(self.state),
            self.action_goal.goal_id.id,
        )
        self.state = int(state)
        if self.transition_cb:
            self.transition_cb(ClientGoalHandle(self))

    def update_status(self, status_array: GoalStatusArray) -> None:
        """Process a list of statuses."""
        with self.mutex:
            if self.state == _DONE:
                return
            status = find_status(status_array, self.action_goal.goal_id.id)
            if status is not None:
                self.latest_goal_status = status
                self._follow(status.status)
            elif self.state not in _MAY_BE_MISSING:
                self._mark_as_lost()

    def update_result(self, action_result: ActionResult) -> None:
        """Process a result; ignore a result for another goal."""
        if self.action_goal.goal_id.id != action_result.status.goal_id.id:
            return
        with self.mutex:
            self.latest_goal_status = action_result.status
            self.latest_result = action_result
            if self.state == _DONE:
                rospy.logerr("Got a result when we were already in the DONE state")
            elif self.state == CommState.LOST:
                rospy.logerr("In a funny state: %i", self.state)
            else:
                # The status list may arrive later or never, so make the transitions for this status now.
                self._follow(action_result.status.status)
                self.transition_to(_DONE)

    def update_feedback(self, action_feedback: ActionFeedback) -> None:
        """Process feedback; ignore feedback for another goal."""
        if self.action_goal.goal_id.id != action_feedback.status.goal_id.id:
            return
        with self.mutex:
            if self.feedback_cb and self.state != _DONE:
                self.feedback_cb(ClientGoalHandle(self), action_feedback.feedback)

    def lose(self) -> bool:
        """Mark the goal as LOST because its server is gone; return False if the goal had already ended."""
        with self.mutex:
            if self.state == _DONE:
                return False
            self._mark_as_lost()
            return True

    def _mark_as_lost(self) -> None:
        self.latest_goal_status.status = GoalStatus.LOST
        self.transition_to(_DONE)

    def _follow(self, status: int) -> None:
        """Make the transitions that lead to the state for ``status``."""
        if self.state == CommState.LOST:
            rospy.logerr("CommStateMachine is in a funny state: %i", self.state)
            return
        try:
            steps = client_steps(self.state, status)
        except KeyError:
            rospy.logerr("Got an unknown status from the ActionServer: %i", status)
            return
        if steps is None:
            rospy.logerr(
                "Invalid goal status transition from %s to %s",
                CommState.to_string(self.state),
                get_name_of_constant(GoalStatus, status),
            )
            return
        for state in steps:
            self.transition_to(state)


class GoalManager:
    """Creates one action client's goals, and passes the server's messages to each of them.

    The manager has only weak references to the goals, so a goal without handles receives no further messages.
    """

    _numbers = itertools.count(1)

    def __init__(self, ActionSpec: type[Action]) -> None:
        types = action_types(ActionSpec)
        self.list_mutex = threading.RLock()
        self.statuses: list[weakref.ref[CommStateMachine]] = []
        self.send_goal_fn: Callable[[ActionGoal], object] | None = None
        self.cancel_fn: Callable[[GoalID], object] = _no_cancel
        self.ActionSpec = ActionSpec
        self.ActionGoal = types.action_goal
        self.ActionResult = types.action_result
        self.ActionFeedback = types.action_feedback

    def register_send_goal_fn(self, fn: Callable[[ActionGoal], object]) -> None:
        """Set the function that publishes a goal."""
        self.send_goal_fn = fn

    def register_cancel_fn(self, fn: Callable[[GoalID], object]) -> None:
        """Set the function that publishes a cancel request."""
        self.cancel_fn = fn

    def init_goal(
        self,
        goal: Message,
        transition_cb: TransitionCallback | None = None,
        feedback_cb: FeedbackCallback | None = None,
    ) -> ClientGoalHandle:
        """Send a goal and return its handle."""
        action_goal = self.ActionGoal(goal_id=self._generate_id(), goal=goal)
        action_goal.header.stamp = rospy.get_rostime()
        machine = CommStateMachine(action_goal, transition_cb, feedback_cb, self.send_goal_fn, self.cancel_fn)
        # Register the goal before sending it: the server's response may arrive before the send function returns.
        with self.list_mutex:
            self.statuses.append(weakref.ref(machine, self._forget))
        if self.send_goal_fn:
            self.send_goal_fn(action_goal)
        return ClientGoalHandle(machine)

    def update_statuses(self, status_array: GoalStatusArray) -> None:
        """Process a status list for all goals, even if a goal's callback raises an error.

        Raise the first of these errors at the end, and log the others.
        """
        first: BaseException | None = None
        for machine in self._get_live_statuses():
            try:
                machine.update_status(status_array)
            except (Exception, SystemExit) as error:  # noqa: BLE001 - of the program's own callback
                if first is None:
                    first = error
                else:
                    current_session().callback_errors.log(machine.transition_cb, error)
        if first is not None:
            raise first

    def update_results(self, action_result: ActionResult) -> None:
        """Process a result."""
        for machine in self._get_live_statuses():
            machine.update_result(action_result)

    def update_feedbacks(self, action_feedback: ActionFeedback) -> None:
        """Process feedback."""
        for machine in self._get_live_statuses():
            machine.update_feedback(action_feedback)

    def unfinished(self) -> list[CommStateMachine]:
        """Return the goals that have not ended."""
        return [machine for machine in self._get_live_statuses() if machine.state != _DONE]

    def _generate_id(self) -> GoalID:
        now = rospy.Time.now()
        return GoalID(stamp=now, id=f"{rospy.get_caller_id()}-{next(self._numbers)}-{now.to_sec():.3f}")

    def _get_live_statuses(self) -> list[CommStateMachine]:
        with self.list_mutex:
            # Iterate over a copy: the garbage collector may call _forget in this thread.
            references = list(self.statuses)
        machines = [reference() for reference in references]
        return [machine for machine in machines if machine is not None]

    def _forget(self, reference: weakref.ref[CommStateMachine]) -> None:
        with self.list_mutex:
            self.statuses.remove(reference)


def _no_cancel(goal_id: GoalID) -> None:
    """Do nothing: without a client, the manager cannot send cancel requests."""
