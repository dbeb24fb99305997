"""interactive_markers.interactive_marker_server, provided by minirospy. Source: http://wiki.ros.org/interactive_markers."""

from std_msgs.msg import Header

from minirospy.ros.interactive_markers.interactive_markers.interactive_marker_server import (
    InteractiveMarkerServer,
    MarkerContext,
    UpdateContext,
)

__all__ = [
    "Header",
    "InteractiveMarkerServer",
    "MarkerContext",
    "UpdateContext",
]
