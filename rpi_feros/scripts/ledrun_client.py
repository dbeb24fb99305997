#!/usr/bin/env python3
"""Send /run_led a goal of /number_of_runs runs, and cancel it when an object is closer to the scanner than 0.2 m."""

import actionlib
import rospy
from rpi_msgs.msg import runningLedAction, runningLedFeedback, runningLedGoal
from sensor_msgs.msg import LaserScan

NEAR = 0.2  # metres


def show(feedback: runningLedFeedback) -> None:
    rospy.loginfo("Run %d starts.", feedback.currentRun)


def main() -> None:
    rospy.init_node("ledrun_client")
    client = actionlib.SimpleActionClient("run_led", runningLedAction)
    client.wait_for_server()
    client.send_goal(runningLedGoal(numberOfRuns=rospy.get_param("/number_of_runs", 10)), feedback_cb=show)
    is_stopped = False

    def measured(scan: LaserScan) -> None:
        nonlocal is_stopped
        if not is_stopped and min(scan.ranges) < NEAR:
            is_stopped = True
            rospy.logwarn("Something is nearer than %g m: stop.", NEAR)
            client.cancel_goal()

    scans = rospy.Subscriber("/sick_safetyscanners/scan", LaserScan, measured, queue_size=1)
    client.wait_for_result()
    scans.unregister()
    result = client.get_result()
    if result is None:
        rospy.logerr("The goal was not run: %s", client.get_goal_status_text())
    else:
        rospy.loginfo("%s after %d runs.", "Stopped" if is_stopped else "Done", result.finalRun)


if __name__ == "__main__":
    try:
        main()
    except rospy.ROSInterruptException:
        pass  # Ctrl-C while waiting
