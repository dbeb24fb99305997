#!/usr/bin/env python3
"""Spawns turtle2, which follows turtle1's frame; see http://wiki.ros.org/turtle_tf2."""

import math

import rospy
import tf2_ros
from geometry_msgs.msg import Twist
from turtlesim.srv import Spawn


def main() -> None:
    rospy.init_node("tf2_turtle_listener")
    frames = tf2_ros.Buffer()
    listener = tf2_ros.TransformListener(frames)  # noqa: F841

    rospy.wait_for_service("spawn")
    name = rospy.get_param("turtle", "turtle2")
    rospy.ServiceProxy("spawn", Spawn)(4, 2, 0, name)
    publisher = rospy.Publisher(f"{name}/cmd_vel", Twist, queue_size=1)

    rate = rospy.Rate(10)
    while not rospy.is_shutdown():
        try:
            target = frames.lookup_transform(name, "turtle1", rospy.Time()).transform.translation
        except tf2_ros.TransformException:
            # Some frames have not been received yet, so try again later.
            pass
        else:
            twist = Twist()
            twist.angular.z = 4 * math.atan2(target.y, target.x)
            twist.linear.x = 0.5 * math.hypot(target.x, target.y)
            publisher.publish(twist)
        rate.sleep()


if __name__ == "__main__":
    try:
        main()
    except rospy.ROSInterruptException:
        pass
