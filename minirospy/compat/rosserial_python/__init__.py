"""rosserial_python. Source: http://wiki.ros.org/rosserial_python."""

from __future__ import annotations

from minirospy.rosserial.client import SerialClient
from minirospy.rosserial.server import RosSerialServer

__all__ = ["RosSerialServer", "SerialClient"]
