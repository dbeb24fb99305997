"""smach_ros.introspection, provided by minirospy. Source: http://wiki.ros.org/smach."""

from minirospy.ros.smach_ros.smach_ros.introspection import (
    INIT_TOPIC,
    STATUS_TOPIC,
    STRUCTURE_TOPIC,
    ContainerProxy,
    IntrospectionClient,
    IntrospectionServer,
)

__all__ = [
    "INIT_TOPIC",
    "STATUS_TOPIC",
    "STRUCTURE_TOPIC",
    "ContainerProxy",
    "IntrospectionClient",
    "IntrospectionServer",
]
