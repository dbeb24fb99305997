"""tf2_ros's buffer_server: a buffer that nodes query through the action tf2_buffer_server instead of subscribing to /tf.

Parameters: ~buffer_size (seconds, 120), ~publish_frame_service (false). Source: http://wiki.ros.org/tf2_ros.
"""

from __future__ import annotations

from collections.abc import Sequence

from minirospy import client as rospy
from minirospy.ros.tf2_ros.tf2_ros.buffer import Buffer
from minirospy.ros.tf2_ros.tf2_ros.listener import TransformListener
from minirospy.ros.tf2_ros.tf2_ros.server import BufferServer
from minirospy.ros.tf2_ros.tools.program import ToolError, run_program

__all__ = ["main"]

_BUFFER_SECONDS = 120.0


def main(words: Sequence[str] | None = None) -> int:
    """Run the node; return the exit status."""
    return run_program(_run, words)


def _run(words: Sequence[str]) -> None:
    rospy.init_node("tf_buffer")
    seconds = rospy.get_param("~buffer_size", _BUFFER_SECONDS)
    if not isinstance(seconds, int | float) or isinstance(seconds, bool) or seconds <= 0:
        raise ToolError(f"~buffer_size is [{seconds}]: it is a number of seconds, above 0", status=1)
    buffer = Buffer(
        rospy.Duration.from_sec(seconds), debug=bool(rospy.get_param("~publish_frame_service", False))
    )
    TransformListener(buffer)
    BufferServer(buffer, "tf2_buffer_server", auto_start=True)
    rospy.spin()
