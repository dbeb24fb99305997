"""tf2_ros.buffer_interface: the common base class of buffers and buffer clients. Source: http://wiki.ros.org/tf2_ros."""

from std_msgs.msg import Header

from minirospy.ros.tf2_ros.tf2_ros.interface import (
    BufferInterface,
    ConvertRegistration,
    NotImplementedException,
    Stamped,
    TransformRegistration,
    TypeException,
    convert,
)

__all__ = [
    "BufferInterface",
    "ConvertRegistration",
    "Header",
    "NotImplementedException",
    "Stamped",
    "TransformRegistration",
    "TypeException",
    "convert",
]
