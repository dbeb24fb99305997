"""rospy.msg: messages with a length prefix."""

from io import BytesIO

import rospy
from genpy import DeserializationError
from referee import outcome, show
from rospy.msg import AnyMsg, args_kwds_to_message, deserialize_messages, serialize_message
from std_msgs.msg import Header, Int32, String

buffer = BytesIO()
serialize_message(buffer, 7, String("hello"))
show(buffer.getvalue(), buffer.tell())
serialize_message(buffer, 8, String("you"))
show(buffer.getvalue(), buffer.tell())
for options in ({}, {"queue_size": 1}, {"max_msgs": 1}, {"start": 9}):
    copy, queue = BytesIO(), []
    copy.write(buffer.getvalue() + b"\3\0")
    outcome(f"deserialize {options}", lambda: deserialize_messages(copy, queue, String, **options))
    show([message.data for message in queue], copy.getvalue(), copy.tell())
short, queue = BytesIO(), []
short.write(b"\2\0")
outcome("short", lambda: deserialize_messages(short, queue, String))
show(queue, short.getvalue(), short.tell())
wrong = BytesIO()
wrong.write(b"\1\0\0\0x")
try:
    deserialize_messages(wrong, [], Int32)
except DeserializationError as error:
    show(type(error).__name__)
for args, kwds in (
    ((1,), {}),
    ((), {"data": 3}),
    ((1, 2), {}),
    ((), {"nope": 1}),
    ((Int32(4),), {}),
    ((1,), {"data": 2}),
    ((), {}),
):
    outcome(f"{args} {kwds}", lambda: args_kwds_to_message(Int32, args, kwds).data)
outcome("header", lambda: args_kwds_to_message(Header, (1, rospy.Time(2), "x"), {}).frame_id)
outcome("AnyMsg", lambda: AnyMsg(1))
anything = AnyMsg()
outcome("serialize", lambda: anything.serialize(BytesIO()))
anything.deserialize(b"abc")
outcome("serialize", lambda: serialize_message(buffer, 1, anything))
show(buffer.getvalue()[-7:], AnyMsg._type, AnyMsg._md5sum, AnyMsg._has_header)
