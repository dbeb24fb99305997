"""Provides the names in ROS's module rospy.exceptions."""

from minirospy.base.errors import (
    ROSException,
    ROSInitException,
    ROSInternalException,
    ROSSerializationException,
    TransportException,
    TransportInitError,
    TransportTerminated,
)
from minirospy.client.lifecycle import ROSInterruptException
from minirospy.client.time import ROSTimeMovedBackwardsException

__all__ = [
    "ROSException",
    "ROSInitException",
    "ROSInternalException",
    "ROSInterruptException",
    "ROSSerializationException",
    "ROSTimeMovedBackwardsException",
    "TransportException",
    "TransportInitError",
    "TransportTerminated",
]
