"""mimic: reads `input/pose` and publishes `output/cmd_vel`, so that a turtle copies the motion of another.

`input` and `output` are namespaces that you remap: `input:=turtlesim1/turtle1`. Source: http://wiki.ros.org/turtlesim.
"""

from __future__ import annotations

import contextlib

from geometry_msgs.msg import Twist
from turtlesim.msg import Pose

from minirospy import client as rospy
from minirospy.base.names import join

__all__ = ["main"]


def main() -> int:
    """Run the node until it shuts down; return the exit status."""
    rospy.init_node("turtle_mimic")
    publisher = rospy.Publisher(join(rospy.resolve_name("output"), "cmd_vel"), Twist, queue_size=1)

    def copy(pose: Pose) -> None:
        twist = Twist()
        twist.linear.x, twist.angular.z = pose.linear_velocity, pose.angular_velocity
        with contextlib.suppress(rospy.ROSException):
            # publish() raises an exception while the node shuts down.
            publisher.publish(twist)

    subscriber = rospy.Subscriber(join(rospy.resolve_name("input"), "pose"), Pose, copy, queue_size=1)
    rospy.spin()
    subscriber.unregister()
    return 0
