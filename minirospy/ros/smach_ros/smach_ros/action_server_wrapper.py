"""Provides an action server that executes a container for each goal."""

from __future__ import annotations

import copy
import traceback
from collections.abc import Iterable, Mapping

from minirospy import client as rospy
from minirospy.core.idl.protocols import Action, Message
from minirospy.ros.actionlib.actionlib.simple_server import SimpleActionServer
from minirospy.ros.smach.smach.container import Container
from minirospy.ros.smach.smach.exceptions import InvalidUserCodeError
from minirospy.ros.smach.smach.user_data import Remapper, UserData

__all__ = ["ActionServerWrapper"]


class ActionServerWrapper:
    """Executes a container for each goal of an action; the container's outcome determines the goal's final state."""

    def __init__(
        self,
        server_name: str,
        action_spec: type[Action],
        wrapped_container: Container,
        succeeded_outcomes: Iterable[str] = (),
        aborted_outcomes: Iterable[str] = (),
        preempted_outcomes: Iterable[str] = (),
        goal_key: str = "action_goal",
        feedback_key: str = "action_feedback",
        result_key: str = "action_result",
        goal_slots_map: Mapping[str, str] | None = None,
        feedback_slots_map: Mapping[str, str] | None = None,
        result_slots_map: Mapping[str, str] | None = None,
        expand_goal_slots: bool = False,
        pack_result_slots: bool = False,
    ) -> None:
        """Store the names of the container's userdata keys for the goal, the feedback and the result.

        ``goal_slots_map`` and ``result_slots_map`` map fields of the goal and of the result to keys. If
        ``expand_goal_slots`` and ``pack_result_slots``, every field is used under its own name.
        """
        self.wrapped_container = wrapped_container
        self.wrapped_container.register_transition_cb(self.transition_cb)
        self.wrapped_container.register_termination_cb(self.termination_cb)
        self._goal_key, self._feedback_key, self._result_key = goal_key, feedback_key, result_key
        self._goal_slots_map = dict(goal_slots_map or {})
        self._feedback_slots_map = dict(feedback_slots_map or {})
        self._result_slots_map = dict(result_slots_map or {})
        self._expand_goal_slots, self._pack_result_slots = expand_goal_slots, pack_result_slots

        spec = action_spec()
        self.userdata = UserData()
        self.userdata[goal_key] = copy.copy(spec.action_goal.goal)
        self.userdata[result_key] = copy.copy(spec.action_result.result)
        self.userdata[feedback_key] = copy.copy(spec.action_feedback.feedback)

        endings = succeeded, aborted, preempted = (
            set(succeeded_outcomes),
            set(aborted_outcomes),
            set(preempted_outcomes),
        )
        self._succeeded_outcomes, self._aborted_outcomes, self._preempted_outcomes = endings
        if len(succeeded | aborted | preempted) != sum(map(len, endings)):
            rospy.logerr(
                "Succeeded, aborted, and preempted outcome lists were not mutually disjoint... expect undefined behavior."
            )
        self._server_name = server_name
        self._action_server = SimpleActionServer(
            server_name, action_spec, execute_cb=self.execute_cb, auto_start=False
        )

    def run_server(self) -> None:
        """Start the action server without blocking."""
        self._action_server.register_preempt_callback(self.preempt_cb)
        self._action_server.start()
        rospy.loginfo(f"Started SMACH action server wrapper, advertising as '{self._server_name}'")

    def transition_cb(self, userdata: UserData, active_states: list[str]) -> None:
        """Publish the feedback in the container's userdata after a transition."""
        self.publish_feedback(userdata)

    def termination_cb(self, userdata: UserData, terminal_states: list[str], container_outcome: str) -> None:
        """Log the container's outcome."""
        rospy.logdebug(
            f"Wrapped state machine has terminated with final state: {terminal_states} and container outcome: "
            f"{container_outcome}"
        )

    def publish_feedback(self, userdata: UserData) -> None:
        """Publish the feedback in ``userdata``, if there is any."""
        if self._feedback_key in userdata:
            self._action_server.publish_feedback(userdata[self._feedback_key])

    def execute_cb(self, goal: Message) -> None:
        """Execute the container with a goal and set the goal's final state from its outcome."""
        self._store_goal(goal)
        container = self.wrapped_container
        try:
            outcome = container.execute(
                Remapper(
                    self.userdata,
                    container.get_registered_input_keys(),
                    container.get_registered_output_keys(),
                )
            )
        except InvalidUserCodeError:
            rospy.logerr("Exception thrown while executing wrapped container.")
            self._action_server.set_aborted()
            return
        except Exception:  # noqa: BLE001 - the user's states
            rospy.logerr(f"Exception thrown:while executing wrapped container: {traceback.format_exc()}")
            self._action_server.set_aborted()
            return

        result = self._packed_result()
        if outcome in self._succeeded_outcomes:
            rospy.loginfo("SUCCEEDED")
            self._action_server.set_succeeded(result)
        elif outcome in self._preempted_outcomes:
            rospy.loginfo("PREEMPTED")
            self._action_server.set_preempted(result)
        else:
            rospy.loginfo("ABORTED")
            self._action_server.set_aborted(result)

    def _store_goal(self, goal: Message) -> None:
        if self._expand_goal_slots:
            for slot in goal.__slots__:
                self.userdata[slot] = getattr(goal, slot)
        self.userdata[self._goal_key] = goal
        for slot, key in self._goal_slots_map.items():
            self.userdata[key] = getattr(goal, slot)

    def _packed_result(self) -> Message:
        result: Message = self.userdata[self._result_key]
        for slot, key in self._result_slots_map.items():
            setattr(result, slot, self.userdata[key])
        if self._pack_result_slots:
            for slot in result.__slots__:
                if slot in self.userdata:
                    setattr(result, slot, self.userdata[slot])
        return result

    def preempt_cb(self) -> None:
        """Preempt the container."""
        rospy.loginfo("Preempt on state machine requested!")
        self.wrapped_container.request_preempt()
