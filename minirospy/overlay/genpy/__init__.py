"""genpy, provided by minirospy: what generated messages import."""

from genpy import base as base
from genpy import dynamic as dynamic
from genpy import message as message
from genpy import rostime as rostime
from minirospy.base.times import Duration, Time, TVal
from minirospy.core.idl.message import DeserializationError, Message, MessageException, SerializationError
from minirospy.ros.genpy.genpy.message import struct_I

__all__ = [
    "DeserializationError",
    "Duration",
    "Message",
    "MessageException",
    "SerializationError",
    "TVal",
    "Time",
    "struct_I",
]
