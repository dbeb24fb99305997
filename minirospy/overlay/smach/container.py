"""smach.container, provided by minirospy. Source: http://wiki.ros.org/smach."""

from minirospy.compat.smach.container import (
    Container,
)

__all__ = [
    "Container",
]
