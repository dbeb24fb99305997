#!/usr/bin/env python3
"""Log each text that is published on chatter. Source: http://wiki.ros.org/rospy_tutorials."""

import rospy
from std_msgs.msg import String


def heard(message: String) -> None:
    rospy.loginfo("%sI heard %s", rospy.get_caller_id(), message.data)


if __name__ == "__main__":
    rospy.init_node("listener", anonymous=True)
    rospy.Subscriber("chatter", String, heard)
    rospy.spin()
