"""rosserial_python. Source: http://wiki.ros.org/rosserial_python."""

from __future__ import annotations

from minirospy.ros.rosserial_python.rosserial_python.SerialClient import (
    ERROR_MISMATCHED_PROTOCOL,
    ERROR_NO_SYNC,
    ERROR_PACKET_FAILED,
    Publisher,
    RosSerialServer,
    SerialClient,
    ServiceClient,
    ServiceServer,
    Subscriber,
    load_message,
    load_pkg_module,
    load_service,
)

__all__ = [
    "ERROR_MISMATCHED_PROTOCOL",
    "ERROR_NO_SYNC",
    "ERROR_PACKET_FAILED",
    "Publisher",
    "RosSerialServer",
    "SerialClient",
    "ServiceClient",
    "ServiceServer",
    "Subscriber",
    "load_message",
    "load_pkg_module",
    "load_service",
]
