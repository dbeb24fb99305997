"""genpy: provides the names that generated message modules import."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from minirospy.base.errors import DeserializationError, MessageException, SerializationError
    from minirospy.base.times import Duration, Time, TVal
    from minirospy.core.idl.message import Message
    from minirospy.ros.genpy.genpy import base as base
    from minirospy.ros.genpy.genpy import dynamic as dynamic
    from minirospy.ros.genpy.genpy import message as message
    from minirospy.ros.genpy.genpy import rostime as rostime
    from minirospy.ros.genpy.genpy.run_time import struct_I

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
