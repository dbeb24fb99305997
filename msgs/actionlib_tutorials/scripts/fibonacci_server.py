#!/usr/bin/env python3
"""Compute Fibonacci numbers, one a second, as the action fibonacci. Source: http://wiki.ros.org/actionlib_tutorials."""

import actionlib
import rospy
from actionlib_tutorials.msg import FibonacciAction, FibonacciFeedback, FibonacciGoal, FibonacciResult


class FibonacciServer:
    """The server of one action."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.server = actionlib.SimpleActionServer(
            name, FibonacciAction, execute_cb=self.execute, auto_start=False
        )
        self.server.start()

    def execute(self, goal: FibonacciGoal) -> None:
        """Publish the numbers so far each second, until there are as many as the goal wants or it is preempted."""
        feedback = FibonacciFeedback([0, 1])
        rospy.loginfo(
            "%s: Executing, creating fibonacci sequence of order %i with seeds 0, 1", self.name, goal.order
        )
        rate = rospy.Rate(1)  # Hz
        for _ in range(1, goal.order):
            if self.server.is_preempt_requested():
                rospy.loginfo("%s: Preempted", self.name)
                self.server.set_preempted()
                return
            feedback.sequence.append(feedback.sequence[-1] + feedback.sequence[-2])
            self.server.publish_feedback(feedback)
            rate.sleep()

        rospy.loginfo("%s: Succeeded", self.name)
        self.server.set_succeeded(FibonacciResult(feedback.sequence))


if __name__ == "__main__":
    rospy.init_node("fibonacci")
    FibonacciServer(rospy.get_name())
    rospy.spin()
