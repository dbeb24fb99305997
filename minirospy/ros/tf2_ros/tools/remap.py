"""tf_remap: republish /tf_old on /tf with frames renamed as in the parameter ~mappings, ``[{old: a, new: b}]``.

Source: http://wiki.ros.org/tf#tf_remap. In the launch file, the publishing node needs
``<remap from="/tf" to="/tf_old"/>``.
"""

from __future__ import annotations

from collections.abc import Sequence

from tf2_msgs.msg import TFMessage

from minirospy import client as rospy
from minirospy.ros.tf2_ros.tools.program import ToolError, run_program

__all__ = ["main"]


def main(words: Sequence[str] | None = None) -> int:
    """Run the node; return the exit status."""
    return run_program(_run, words)


def _run(words: Sequence[str]) -> None:
    rospy.init_node("tf_remapper")
    mappings = rospy.get_param("~mappings", [])
    if not isinstance(mappings, list) or not all(isinstance(each, dict) for each in mappings):
        raise ToolError(f"~mappings is [{mappings}]: it is a list as [{{old: a, new: b}}]", status=1)
    names = {str(each["old"]): str(each["new"]) for each in mappings if {"old", "new"} <= each.keys()}
    print("Applying the following mappings to incoming tf frame ids", names, flush=True)
    # The queue is long enough to forward a burst of messages without dropping any.
    publisher = rospy.Publisher("/tf", TFMessage, queue_size=100)

    def rename(message: TFMessage) -> None:
        for transform in message.transforms:
            header = transform.header
            header.frame_id = names.get(header.frame_id, header.frame_id)
            transform.child_frame_id = names.get(transform.child_frame_id, transform.child_frame_id)
        publisher.publish(message)

    rospy.Subscriber("/tf_old", TFMessage, rename)
    rospy.spin()
