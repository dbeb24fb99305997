#!/usr/bin/env python3
"""Publish on /button_state whether an object is closer to the scanner than 0.2 m, so that the scanner acts as a button."""

import rospy
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Bool

NEAR = 0.2  # metres


def main() -> None:
    rospy.init_node("sick_dist_switch")
    publisher = rospy.Publisher("/button_state", Bool, queue_size=10)

    def measured(scan: LaserScan) -> None:
        publisher.publish(Bool(data=min(scan.ranges) < NEAR))

    rospy.Subscriber("/sick_safetyscanners/scan", LaserScan, measured, queue_size=1)
    rospy.spin()


if __name__ == "__main__":
    main()
