#!/usr/bin/env python3
"""Request 20 Fibonacci numbers of fibonacci_server.py. Source: http://wiki.ros.org/actionlib_tutorials."""

import sys

import actionlib
import rospy
from actionlib_tutorials.msg import FibonacciAction, FibonacciGoal


def main() -> int:
    rospy.init_node("fibonacci_client_py")
    client = actionlib.SimpleActionClient("fibonacci", FibonacciAction)
    client.wait_for_server()
    client.send_goal(FibonacciGoal(order=20))
    client.wait_for_result()
    if rospy.is_shutdown():
        print("program interrupted before completion", file=sys.stderr)
        return 130
    print("Result:", ", ".join(str(number) for number in client.get_result().sequence))
    return 0


if __name__ == "__main__":
    sys.exit(main())
