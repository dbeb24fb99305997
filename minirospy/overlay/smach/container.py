"""smach.container, provided by minirospy. Source: http://wiki.ros.org/smach."""

from minirospy.ros.smach.smach.container import Container

__all__ = [
    "Container",
]
