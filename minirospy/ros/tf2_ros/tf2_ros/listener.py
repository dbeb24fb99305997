"""tf2_ros.TransformListener: inserts transforms from /tf and /tf_static into a buffer. Source: http://wiki.ros.org/tf2_ros."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Mapping
from typing import Protocol

from geometry_msgs.msg import TransformStamped

from minirospy import client as rospy
from minirospy.base.errors import DeserializationError
from minirospy.ros.tf2_ros.tf2_ros.core import BufferCore
from minirospy.ros.tf2_ros.tf2_ros.messages import LazyTFMessage

__all__ = ["TransformListener"]


class TransformSink(Protocol):
    """The object that receives a listener's transforms: a Buffer, or an object that the program defines."""

    def set_transform(self, transform: TransformStamped, authority: str, /) -> object:
        """Insert a transform."""

    def set_transform_static(self, transform: TransformStamped, authority: str, /) -> object:
        """Insert a static transform, which is valid at all times."""

    def clear(self) -> object:
        """Remove all transforms except static ones."""


class TransformListener:
    """Inserts every transform on /tf and /tf_static into ``buffer``, and clears the buffer if time jumps back.

    ``queue_size``, ``buff_size`` and ``tcp_nodelay`` are passed to the Subscribers.
    """

    def __init__(
        self,
        buffer: TransformSink,
        queue_size: int | None = None,
        buff_size: int = 65536,
        tcp_nodelay: bool = False,
    ) -> None:
        self.buffer = buffer
        self.last_update_lock = threading.Lock()
        self._last = rospy.get_time()
        self._takes_bytes = _takes_bytes(buffer)
        self.tf_sub = rospy.Subscriber(
            "/tf", LazyTFMessage, self.callback, None, queue_size, buff_size, tcp_nodelay
        )
        self.tf_static_sub = rospy.Subscriber(
            "/tf_static", LazyTFMessage, self.static_callback, None, queue_size, buff_size, tcp_nodelay
        )

    def __del__(self) -> None:
        # Suppress all errors: the constructor may have failed halfway, or the interpreter may be exiting.
        with contextlib.suppress(Exception):
            self.unregister()

    def unregister(self) -> None:
        """Unsubscribe from /tf and /tf_static."""
        self.tf_sub.unregister()
        self.tf_static_sub.unregister()

    def check_for_reset(self) -> None:
        """Clear the buffer if time has jumped back since the last message."""
        # Hold the lock while reading the time: a thread that is overtaken by another would otherwise detect a false jump.
        with self.last_update_lock:
            now = rospy.get_time()
            jump, self._last = self._last - now, now
            if jump > 0:
                rospy.logwarn("Detected jump back in time of %fs. Clearing TF buffer.", jump)
                self.buffer.clear()

    @property
    def last_update(self) -> rospy.Time:
        """Return the time of the last message."""
        return rospy.Time.from_sec(self._last)

    def callback(self, data: LazyTFMessage) -> None:
        """Insert the transforms in a message on /tf."""
        self._take(data, is_static=False)

    def static_callback(self, data: LazyTFMessage) -> None:
        """Insert the transforms in a message on /tf_static."""
        self._take(data, is_static=True)

    def _take(self, data: LazyTFMessage, *, is_static: bool) -> None:
        self.check_for_reset()
        header: Mapping[str, str] = data._connection_header
        who = header.get("callerid", "default_authority")

        raw = getattr(data, "raw", None)
        if self._takes_bytes and raw is not None:
            assert isinstance(self.buffer, BufferCore)
            try:
                self.buffer.insert_message(raw, who, is_static)
            except DeserializationError as error:
                rospy.logerr_throttle(1.0, f"a message of {who} is not a tf2_msgs/TFMessage: {error}")
            return

        insert = self.buffer.set_transform_static if is_static else self.buffer.set_transform
        for transform in data.transforms:
            insert(transform, who)


def _takes_bytes(buffer: TransformSink) -> bool:
    """Return whether a buffer accepts undecoded messages: true for a BufferCore that does not override set_transform."""
    kind = type(buffer)
    return (
        issubclass(kind, BufferCore)
        and kind.set_transform is BufferCore.set_transform
        and kind.set_transform_static is BufferCore.set_transform_static
    )
