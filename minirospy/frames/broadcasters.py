"""tf2_ros.TransformBroadcaster and StaticTransformBroadcaster: transforms -> /tf and /tf_static.

Source: http://wiki.ros.org/tf2_ros.
"""

from __future__ import annotations

from collections.abc import Sequence

from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage

from minirospy import client as rospy

__all__ = ["StaticTransformBroadcaster", "TransformBroadcaster"]


class TransformBroadcaster:
    """Publishes transforms on /tf."""

    def __init__(self) -> None:
        self.pub_tf = rospy.Publisher("/tf", TFMessage, queue_size=100)

    def sendTransform(self, transform: TransformStamped | Sequence[TransformStamped]) -> None:  # noqa: N802
        """Publish a transform, or several in one message."""
        self.pub_tf.publish(TFMessage(_listed(transform)))


class StaticTransformBroadcaster:
    """Publishes transforms that hold at every time on /tf_static, latched: listeners that come later get all of them.

    A transform replaces the one that was sent before of the same child frame.
    """

    def __init__(self) -> None:
        self.pub_tf = rospy.Publisher("/tf_static", TFMessage, queue_size=100, latch=True)
        self.net_message = TFMessage()

    def sendTransform(self, transform: TransformStamped | Sequence[TransformStamped]) -> None:  # noqa: N802
        """Publish a transform, or several, together with all that were sent before."""
        by_child = {each.child_frame_id: each for each in (*self.net_message.transforms, *_listed(transform))}
        self.net_message = TFMessage(list(by_child.values()))
        self.pub_tf.publish(self.net_message)


def _listed(transform: TransformStamped | Sequence[TransformStamped]) -> list[TransformStamped]:
    return list(transform) if isinstance(transform, list | tuple) else [transform]  # type: ignore[list-item]
