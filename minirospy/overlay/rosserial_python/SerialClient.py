"""rosserial_python.SerialClient, provided by minirospy. Source: http://wiki.ros.org/rosserial_python."""

from minirospy.ros.rosserial_python.rosserial_python.SerialClient import (
    ERROR_MISMATCHED_PROTOCOL,
    ERROR_NO_SYNC,
    ERROR_PACKET_FAILED,
    RosSerialServer,
    SerialClient,
)

__all__ = [
    "ERROR_MISMATCHED_PROTOCOL",
    "ERROR_NO_SYNC",
    "ERROR_PACKET_FAILED",
    "RosSerialServer",
    "SerialClient",
]
