"""genpy, provided by minirospy: what generated messages import."""

from genpy import base as base
from genpy import dynamic as dynamic
from genpy import message as message
from genpy import rostime as rostime
from minirospy.base.times import Duration, Time, TVal
from minirospy.compat.genpy.message import struct_I
from minirospy.core.idl.message import DeserializationError, Message, MessageException, SerializationError

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
