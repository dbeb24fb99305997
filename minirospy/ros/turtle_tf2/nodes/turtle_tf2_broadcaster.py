#!/usr/bin/env python3
"""Publishes the pose of the turtle ~turtle as its frame in `world`, on /tf; see http://wiki.ros.org/turtle_tf2."""

import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped
from tf_conversions import transformations
from turtlesim.msg import Pose


def main() -> None:
    rospy.init_node("tf2_turtle_broadcaster")
    name = rospy.get_param("~turtle")
    broadcaster = tf2_ros.TransformBroadcaster()

    def publish_frame(pose: Pose) -> None:
        frame = TransformStamped()
        frame.header.stamp = rospy.Time.now()
        frame.header.frame_id = "world"
        frame.child_frame_id = name
        position, rotation = frame.transform.translation, frame.transform.rotation
        position.x, position.y = pose.x, pose.y
        rotation.x, rotation.y, rotation.z, rotation.w = transformations.quaternion_from_euler(
            0, 0, pose.theta
        )
        broadcaster.sendTransform(frame)

    rospy.Subscriber(f"/{name}/pose", Pose, publish_frame)
    rospy.spin()


if __name__ == "__main__":
    main()
