"""tf.TransformBroadcaster: publishes transforms, given as tuples, on /tf. Source: http://wiki.ros.org/tf."""

from __future__ import annotations

from collections.abc import Sequence

from geometry_msgs.msg import TransformStamped

from minirospy.base import times
from minirospy.ros.tf2_ros.tf2_ros import broadcasters

__all__ = ["TransformBroadcaster"]


class TransformBroadcaster:
    """Publishes transforms on /tf. As in real ROS, ``queue_size`` has no effect."""

    def __init__(self, queue_size: int = 100) -> None:
        self.tf2_broadcaster = broadcasters.TransformBroadcaster()

    def sendTransform(
        self,
        translation: Sequence[float],
        rotation: Sequence[float],
        time: times.Time,
        child: str,
        parent: str,
    ) -> None:
        """Publish the pose of frame ``child`` in frame ``parent``: (x, y, z) and a quaternion (x, y, z, w)."""
        message = TransformStamped(child_frame_id=child)
        message.header.frame_id = parent
        message.header.stamp = time
        where, turn = message.transform.translation, message.transform.rotation
        where.x, where.y, where.z = translation[0], translation[1], translation[2]
        turn.x, turn.y, turn.z, turn.w = rotation[0], rotation[1], rotation[2], rotation[3]
        self.sendTransformMessage(message)

    def sendTransformMessage(self, transform: TransformStamped) -> None:
        """Publish a transform."""
        self.tf2_broadcaster.sendTransform([transform])
