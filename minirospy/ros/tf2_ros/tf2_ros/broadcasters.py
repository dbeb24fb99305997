"""tf2_ros.TransformBroadcaster and StaticTransformBroadcaster: publish transforms on /tf and /tf_static.

Source: http://wiki.ros.org/tf2_ros.
"""

from __future__ import annotations

import copy
import threading
from collections.abc import Sequence
from weakref import WeakKeyDictionary

from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage

from minirospy import client as rospy

__all__ = ["StaticTransformBroadcaster", "TransformBroadcaster"]


class TransformBroadcaster:
    """Publishes transforms on /tf."""

    def __init__(self) -> None:
        self.pub_tf = rospy.Publisher("/tf", TFMessage, queue_size=100)

    def sendTransform(self, transform: TransformStamped | Sequence[TransformStamped]) -> None:
        """Publish one or more transforms in a single message."""
        self.pub_tf.publish(TFMessage(_listed(transform)))


class StaticTransformBroadcaster:
    """Publishes static transforms on the latched topic /tf_static, so that later subscribers receive all of them.

    A transform replaces an earlier one for the same child frame. The broadcasters of a process share their transforms,
    because a node has only one latched message per topic; in real ROS, that message contains only the last broadcaster's
    transforms.
    """

    _lock = threading.Lock()
    _sent: WeakKeyDictionary[object, dict[str, TransformStamped]] = WeakKeyDictionary()
    """The transforms keyed by child frame, for each topic handle. All broadcasters of a node share them."""

    def __init__(self) -> None:
        self.pub_tf = rospy.Publisher("/tf_static", TFMessage, queue_size=100, latch=True)

    @property
    def net_message(self) -> TFMessage:
        """Return a message that contains all transforms sent so far."""
        return TFMessage(list(self._sent.get(self.pub_tf.impl, {}).values()))

    def sendTransform(self, transform: TransformStamped | Sequence[TransformStamped]) -> None:
        """Publish one or more transforms, together with all earlier ones."""
        with self._lock:
            sent = self._sent.setdefault(self.pub_tf.impl, {})
            # Copy the transforms, because a program may reuse its message objects.
            sent |= {each.child_frame_id: copy.deepcopy(each) for each in _listed(transform)}
            self.pub_tf.publish(self.net_message)


def _listed(transform: TransformStamped | Sequence[TransformStamped]) -> list[TransformStamped]:
    return list(transform) if isinstance(transform, list | tuple) else [transform]  # type: ignore[list-item]
