"""tf2_ros.TransformBroadcaster and StaticTransformBroadcaster: transforms -> /tf and /tf_static.

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
        """Publish a transform, or several in one message."""
        self.pub_tf.publish(TFMessage(_listed(transform)))


class StaticTransformBroadcaster:
    """Publishes transforms that hold at every time on /tf_static, latched: listeners that come later get all of them.

    A transform replaces the one that was sent before of the same child frame. The broadcasters of a process share what they
    have sent, since a node has one latched message a topic: with the real ones, that of the last broadcaster.
    """

    _lock = threading.Lock()
    _sent: WeakKeyDictionary[object, dict[str, TransformStamped]] = WeakKeyDictionary()
    """By the topic that a node's broadcasters share: the transforms by child frame."""

    def __init__(self) -> None:
        self.pub_tf = rospy.Publisher("/tf_static", TFMessage, queue_size=100, latch=True)

    @property
    def net_message(self) -> TFMessage:
        """All that was sent."""
        return TFMessage(list(self._sent.get(self.pub_tf.impl, {}).values()))

    def sendTransform(self, transform: TransformStamped | Sequence[TransformStamped]) -> None:
        """Publish a transform, or several, together with all that were sent before."""
        with self._lock:
            sent = self._sent.setdefault(self.pub_tf.impl, {})
            # Copies: a program may fill the same message again.
            sent |= {each.child_frame_id: copy.deepcopy(each) for each in _listed(transform)}
            self.pub_tf.publish(self.net_message)


def _listed(transform: TransformStamped | Sequence[TransformStamped]) -> list[TransformStamped]:
    return list(transform) if isinstance(transform, list | tuple) else [transform]  # type: ignore[list-item]
