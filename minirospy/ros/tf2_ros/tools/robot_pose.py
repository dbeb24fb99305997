"""robot_pose_publisher: publish the robot's pose on the map, computed from /tf, on the topic robot_pose.

Parameters: ~map_frame (/map), ~base_frame (/base_link), ~publish_frequency (10 Hz), ~is_stamped (false: Pose, true:
PoseStamped). Source: http://wiki.ros.org/robot_pose_publisher.
"""

from __future__ import annotations

from collections.abc import Sequence

from geometry_msgs.msg import Point, Pose, PoseStamped

from minirospy import client as rospy
from minirospy.base.errors import TransformException
from minirospy.ros.tf2_ros.tf2_ros.buffer import Buffer
from minirospy.ros.tf2_ros.tf2_ros.listener import TransformListener
from minirospy.ros.tf2_ros.tools.program import ToolError, run_program

__all__ = ["main"]


def main(words: Sequence[str] | None = None) -> int:
    """Run the node until it is shut down; return the exit status."""
    return run_program(_run, words)


def _run(words: Sequence[str]) -> None:
    rospy.init_node("robot_pose_publisher")
    map_frame = str(rospy.get_param("~map_frame", "/map"))
    base_frame = str(rospy.get_param("~base_frame", "/base_link"))
    frequency = rospy.get_param("~publish_frequency", 10)
    if isinstance(frequency, bool) or not isinstance(frequency, int | float) or frequency <= 0:
        raise ToolError(f"~publish_frequency is {frequency!r}: it is a number of messages a second", status=1)
    is_stamped = rospy.get_param("~is_stamped", False) is True
    publisher = rospy.Publisher("robot_pose", PoseStamped if is_stamped else Pose, queue_size=1)
    buffer = Buffer()
    TransformListener(buffer)

    rate = rospy.Rate(frequency)
    while not rospy.is_shutdown():
        try:
            found = buffer.lookup_transform(map_frame.lstrip("/"), base_frame.lstrip("/"), rospy.Time(0))
        except TransformException:
            # The robot has no pose until it has been localised.
            pass
        else:
            position = found.transform.translation
            pose = Pose(Point(position.x, position.y, position.z), found.transform.rotation)
            if is_stamped:
                message = PoseStamped(pose=pose)
                message.header.frame_id = map_frame
                message.header.stamp = rospy.Time.now()
                publisher.publish(message)
            else:
                publisher.publish(pose)
        rate.sleep()
