"""rosserial_python, provided by minirospy: devices on a serial line. Source: http://wiki.ros.org/rosserial_python."""

from minirospy.ros.rosserial_python.rosserial_python import RosSerialServer, SerialClient

__all__ = ["RosSerialServer", "SerialClient"]
