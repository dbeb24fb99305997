"""Containers that end with their node."""

from __future__ import annotations

import threading

from minirospy import client as rospy
from minirospy.ros.rospy.rospy.core import add_client_shutdown_hook
from minirospy.ros.smach.smach.concurrence import Concurrence
from minirospy.ros.smach.smach.iterator import Iterator
from minirospy.ros.smach.smach.state_machine import StateMachine

__all__ = ["set_preempt_handler"]


def set_preempt_handler(sc: StateMachine | Concurrence | Iterator) -> None:
    """Request a container to end when the node shuts down, and wait until it has.

    One that executes in the thread that handles the shutdown cannot end meanwhile: it is not waited for.
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
