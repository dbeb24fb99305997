"""Preempts containers when their node shuts down."""

from __future__ import annotations

import threading

from minirospy import client as rospy
from minirospy.ros.rospy.rospy.core import add_client_shutdown_hook
from minirospy.ros.smach.smach.concurrence import Concurrence
from minirospy.ros.smach.smach.iterator import Iterator
from minirospy.ros.smach.smach.state_machine import StateMachine

__all__ = ["set_preempt_handler"]


def set_preempt_handler(sc: StateMachine | Concurrence | Iterator) -> None:
    """When the node shuts down, preempt the container and wait until it has finished.

    If the container executes in the thread that handles the shutdown, do not wait, because the container could never finish.
    """

    def handler() -> None:
        sc.request_preempt()
        if sc.is_running() and getattr(sc, "_executing_thread", None) == threading.get_ident():
            rospy.logwarn(
                "Received shutdown request... sent preempt... not waiting for a state machine of the same thread."
            )
            return
        while sc.is_running():
            rospy.loginfo(
                "Received shutdown request... sent preempt... waiting for state machine to terminate."
            )
            rospy.sleep(1.0)

    add_client_shutdown_hook(handler)
