"""genpy, filled in by minirospy: what generated messages and user code import of it."""

from minirospy.idl.message import DeserializationError, Message, MessageException, SerializationError
from minirospy.times import Duration, Time, TVal

__all__ = [
    "DeserializationError",
    "Duration",
    "Message",
    "MessageException",
    "SerializationError",
    "TVal",
    "Time",
]
