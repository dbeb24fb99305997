"""rosserial_python.SerialClient. Source: http://wiki.ros.org/rosserial_python."""

from __future__ import annotations

from minirospy.ros.rosserial_python.devices.client import (
    ERROR_MISMATCHED_PROTOCOL,
    ERROR_NO_SYNC,
    ERROR_PACKET_FAILED,
    SerialClient,
)
from minirospy.ros.rosserial_python.devices.forwarders import (
    Publisher,
    ServiceClient,
    ServiceServer,
    Subscriber,
    load_message,
    load_pkg_module,
    load_service,
)
from minirospy.ros.rosserial_python.devices.server import RosSerialServer

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
