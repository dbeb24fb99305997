"""draw_square: reads `turtle1/pose` and publishes `turtle1/cmd_vel`, so that turtle1 draws a square.

Source: http://wiki.ros.org/turtlesim.
"""

from __future__ import annotations

import contextlib

from geometry_msgs.msg import Twist
from std_srvs.srv import Empty
from turtlesim.msg import Pose as PoseMessage

from minirospy import client as rospy
from minirospy.ros.turtlesim.square import Square
from minirospy.ros.turtlesim.world import STEP_SECONDS, Pose

__all__ = ["main"]


def main() -> int:
    """Reset turtlesim if it is running, and draw until the node shuts down; return the exit status."""
    rospy.init_node("draw_square")
    drawing = _Drawing()
    with contextlib.suppress(rospy.ServiceException):
        rospy.ServiceProxy("reset", Empty)()
    timer = rospy.Timer(rospy.Duration.from_sec(STEP_SECONDS), drawing.step)
    rospy.spin()
    del timer
    return 0


class _Drawing:
    """Drives the turtle: holds its latest pose, and publishes the next velocity command."""

    def __init__(self) -> None:
        self._pose: PoseMessage | None = None
        self._square = Square()
        self._publisher = rospy.Publisher("turtle1/cmd_vel", Twist, queue_size=1)
        self._subscriber = rospy.Subscriber("turtle1/pose", PoseMessage, self._keep, queue_size=1)

    def _keep(self, pose: PoseMessage) -> None:
        self._pose = pose

    def step(self, _event: object) -> None:
        """Publish the next velocity."""
        if (pose := self._pose) is None:
            return
        order, lines = self._square.step(
            Pose(pose.x, pose.y, pose.theta), pose.linear_velocity, pose.angular_velocity
        )
        for line in lines:
            rospy.loginfo("%s", line)
        if order is not None:
            twist = Twist()
            twist.linear.x, twist.angular.z = order
            with contextlib.suppress(rospy.ROSException):
                # publish() raises an exception while the node shuts down.
                self._publisher.publish(twist)
