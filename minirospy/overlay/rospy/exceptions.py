"""rospy.exceptions, provided by minirospy."""

from minirospy.client.lifecycle import ROSInterruptException
from minirospy.client.time import ROSTimeMovedBackwardsException
from minirospy.errors import (
    ROSException,
    ROSInitException,
    ROSInternalException,
    ROSSerializationException,
    TransportException,
    TransportInitError,
    TransportTerminated,
)

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
