"""rosserial_python. Source: http://wiki.ros.org/rosserial_python."""

from __future__ import annotations

from minirospy.ros.rosserial_python.devices.client import SerialClient
from minirospy.ros.rosserial_python.devices.server import RosSerialServer

__all__ = ["RosSerialServer", "SerialClient"]
