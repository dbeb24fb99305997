#!/usr/bin/env python3
"""Spawns turtle2, which follows turtle1's frame; see http://wiki.ros.org/turtle_tf."""

import math

import rospy
import tf
from geometry_msgs.msg import Twist
from turtlesim.srv import Spawn


def main() -> None:
    rospy.init_node("turtle_tf_listener")
    listener = tf.TransformListener()
    rospy.wait_for_service("spawn")
    rospy.ServiceProxy("spawn", Spawn)(4, 2, 0, "turtle2")
    publisher = rospy.Publisher("turtle2/cmd_vel", Twist, queue_size=1)

    rate = rospy.Rate(10)
    while not rospy.is_shutdown():
        try:
            (x, y, _), _ = listener.lookupTransform("/turtle2", "/turtle1", rospy.Time(0))
        except (tf.LookupException, tf.ConnectivityException, tf.ExtrapolationException):
            # Some frames have not been received yet, so try again later.
            pass
        else:
            twist = Twist()
            twist.angular.z = 4 * math.atan2(y, x)
            twist.linear.x = 0.5 * math.hypot(x, y)
            publisher.publish(twist)
        rate.sleep()


if __name__ == "__main__":
    try:
        main()
    except rospy.ROSInterruptException:
        pass
