"""SimpleActionServer: one goal at a time; a new goal requests preemption of the current one.

Source: http://wiki.ros.org/actionlib/DetailedDescription#Server-Side_Policies.
"""

from __future__ import annotations

import threading
import traceback
from collections.abc import Callable
from typing import Any

from actionlib_msgs.msg import GoalStatus

from minirospy import client as rospy
from minirospy.core.idl.protocols import Action, Message
from minirospy.ros.actionlib.actionlib.handle import ServerGoalHandle
from minirospy.ros.actionlib.actionlib.server import ActionServer
from minirospy.runtime.transport.limits import naming_thread_limit

__all__ = ["SimpleActionServer"]

_REPLACED = "This goal was canceled because another goal was received by the simple action server"
_NOT_ENDED = (
    "Your executeCallback did not set the goal to a terminal status.  This is a bug in your ActionServer "
    "implementation. Fix your code!  For now, the ActionServer will set this goal to aborted"
)
_ACCEPTED = "This goal has been accepted by the simple action server"


class SimpleActionServer:
    """A server that executes one goal at a time.

    ``execute_cb(goal)`` is called for each goal in a separate thread, and must set a terminal state (``set_succeeded``,
    ``set_aborted``, ``set_preempted``). Without ``execute_cb``, use ``register_goal_callback`` to be notified of goals, and
    ``accept_new_goal`` to accept them. With ``execute_cb``, the program runs until the node shuts down. Raise
    ActionException if ``ActionSpec`` is not an action class.
    """

    def __init__(
        self,
        name: str,
        ActionSpec: type[Action],
        execute_cb: Callable[[Any], object] | None = None,
        auto_start: bool = True,
    ) -> None:
        self.new_goal = False
        self.preempt_request = False
        self.new_goal_preempt_request = False
        self.execute_callback = execute_cb
        self.goal_callback: Callable[[], object] | None = None
        self.preempt_callback: Callable[[], object] | None = None
        self.need_to_terminate = False
        self.terminate_mutex = threading.RLock()
        self.current_goal = ServerGoalHandle()
        self.next_goal = ServerGoalHandle()
        self.execute_thread: threading.Thread | None = None
        self.action_server = ActionServer(
            name, ActionSpec, self.internal_goal_callback, self.internal_preempt_callback, auto_start=False
        )
        # Share the action server's lock. With two locks, a goal that arrives while another ends could cause a deadlock.
        self.lock = self.action_server.lock
        self.execute_condition = threading.Condition(self.lock)

        if execute_cb:
            self.execute_thread = threading.Thread(target=self.executeLoop, name="minirospy-action")
            with naming_thread_limit():
                self.execute_thread.start()

        if auto_start:
            self.action_server.warn_of_auto_start()
            self.start()

    def start(self) -> None:
        """Start accepting goals."""
        self.action_server.start()

    def accept_new_goal(self) -> Any:
        """Accept the pending goal and return it, preempting the active one. Return None if no goal is pending."""
        with self.lock:
            if not self.new_goal or not self.next_goal.get_goal():
                rospy.logerr("Attempting to accept the next goal when a new goal is not available")
                return None
            if self.is_active() and self.current_goal != self.next_goal:
                self.current_goal.set_canceled(None, _REPLACED)
            rospy.logdebug("Accepting a new goal")
            self.current_goal = self.next_goal
            self.new_goal = False
            self.preempt_request = self.new_goal_preempt_request
            self.new_goal_preempt_request = False
            self.current_goal.set_accepted(_ACCEPTED)
            return self.current_goal.get_goal()

    def is_new_goal_available(self) -> bool:
        """Return whether a goal is pending."""
        return self.new_goal

    def is_preempt_requested(self) -> bool:
        """Return whether the active goal should be preempted, because it was cancelled or another goal is pending."""
        return self.preempt_request

    def is_active(self) -> bool:
        """Return whether a goal is active."""
        if not self.current_goal.get_goal():
            return False
        return self.current_goal.get_goal_status().status in (GoalStatus.ACTIVE, GoalStatus.PREEMPTING)

    def set_succeeded(self, result: Message | None = None, text: str = "") -> None:
        """Set the current goal's status to SUCCEEDED."""
        with self.lock:
            self.current_goal.set_succeeded(result or self.get_default_result(), text)

    def set_aborted(self, result: Message | None = None, text: str = "") -> None:
        """Set the current goal's status to ABORTED."""
        with self.lock:
            self.current_goal.set_aborted(result or self.get_default_result(), text)

    def set_preempted(self, result: Message | None = None, text: str = "") -> None:
        """Set the current goal's status to PREEMPTED."""
        with self.lock:
            rospy.logdebug("Setting the current goal as canceled")
            self.current_goal.set_canceled(result or self.get_default_result(), text)

    def publish_feedback(self, feedback: Message) -> None:
        """Publish feedback on the current goal."""
        self.current_goal.publish_feedback(feedback)

    def get_default_result(self) -> Message | None:
        """Return an empty result."""
        return self.action_server.ActionResultType()

    def register_goal_callback(self, cb: Callable[[], object] | None) -> None:
        """Set the callback ``cb()`` for new goals. If the server has an execute callback, log a warning instead."""
        if self.execute_callback:
            rospy.logwarn(
                "Cannot call SimpleActionServer.register_goal_callback() because an executeCallback exists. "
                "Not going to register it."
            )
        else:
            self.goal_callback = cb

    def register_preempt_callback(self, cb: Callable[[], object] | None) -> None:
        """Set the callback ``cb()`` for requests to preempt the active goal."""
        self.preempt_callback = cb

    def internal_goal_callback(self, goal: ServerGoalHandle) -> None:
        """Process a new goal."""
        with self.lock:
            rospy.logdebug(
                "A new goal %s has been received by the single goal action server", goal.get_goal_id().id
            )
            if _is_older(goal, self.current_goal) or _is_older(goal, self.next_goal):
                goal.set_canceled(None, _REPLACED)
                return

            if self.next_goal.get_goal() and self.next_goal != self.current_goal:
                self.next_goal.set_canceled(None, _REPLACED)
            self.next_goal = goal
            self.new_goal = True
            self.new_goal_preempt_request = False

            try:
                if self.is_active():
                    self.preempt_request = True
                    if self.preempt_callback:
                        self.preempt_callback()
                if self.goal_callback:
                    self.goal_callback()
            except BaseException as error:  # noqa: BLE001 - user code failed, but the goal has arrived
                rospy.logerr("SimpleActionServer.internal_goal_callback - exception %s", error)

            self.execute_condition.notify_all()

    def internal_preempt_callback(self, preempt: ServerGoalHandle) -> None:
        """Process a client's request to cancel a goal."""
        with self.lock:
            rospy.logdebug("A preempt has been received by the SimpleActionServer")
            if preempt == self.current_goal:
                rospy.logdebug(
                    "Setting preempt_request bit for the current goal to TRUE and invoking callback"
                )
                self.preempt_request = True
                if self.preempt_callback:
                    self.preempt_callback()
            else:
                rospy.logdebug("Setting preempt request bit for the next goal to TRUE")
                self.new_goal_preempt_request = True

    def executeLoop(self) -> None:
        """Run the execute callback for each goal, in the execute thread."""
        with rospy.interrupting(self._wake_soon):
            while True:
                with self.lock:
                    self.execute_condition.wait_for(self._has_work)
                    if self.need_to_terminate or rospy.is_down():
                        return
                    goal = self.accept_new_goal()
                self._execute(goal)

    def _has_work(self) -> bool:
        return self.need_to_terminate or rospy.is_down() or (self.new_goal and not self.is_active())

    def _execute(self, goal: Message) -> None:
        assert self.execute_callback
        try:
            self.execute_callback(goal)
        except BaseException as error:  # noqa: BLE001 - user code failed; serve the next goals
            # Exceptions are expected during a shutdown.
            # Ctrl-C interrupts sleeps, and a shutdown hook may have closed resources that the callback uses.
            if not rospy.is_shutdown_requested():
                rospy.logerr("Exception in your execute callback: %s\n%s", error, traceback.format_exc())
                self.set_aborted(None, f"Exception in execute callback: {error}")
        else:
            if self.is_active() and not rospy.is_shutdown_requested():
                rospy.logwarn(_NOT_ENDED)
                self.set_aborted(None, "No terminal state was set.")

    def _wake_soon(self) -> None:
        """Wake the execute loop from a new thread, because a blocking callback may hold the lock."""
        with naming_thread_limit():
            threading.Thread(target=self._wake, name="minirospy-action-end", daemon=True).start()

    def _wake(self) -> None:
        with self.lock:
            self.execute_condition.notify_all()


def _is_older(goal: ServerGoalHandle, than: ServerGoalHandle) -> bool:
    return bool(than.get_goal()) and goal.get_goal_id().stamp < than.get_goal_id().stamp
