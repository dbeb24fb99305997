#!/usr/bin/env python3
"""Publishes the pose of the turtle ~turtle as its frame in `world`, on /tf; see http://wiki.ros.org/turtle_tf."""

import rospy
import tf
from turtlesim.msg import Pose


def main() -> None:
    rospy.init_node("turtle_tf_broadcaster")
    name = rospy.get_param("~turtle")
    broadcaster = tf.TransformBroadcaster()

    def publish_frame(pose: Pose) -> None:
        rotation = list(tf.transformations.quaternion_from_euler(0, 0, pose.theta))
        broadcaster.sendTransform((pose.x, pose.y, 0), rotation, rospy.Time.now(), name, "world")

    rospy.Subscriber(f"/{name}/pose", Pose, publish_frame)
    rospy.spin()


if __name__ == "__main__":
    main()
