"""genpy as a library: checks of values, filling, text forms, comparisons of times, and copies of messages."""

import copy
import io
import pickle

import genpy
import genpy.dynamic
import genpy.message
import rospy
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point, PointStamped, PoseStamped, PoseWithCovariance
from nav_msgs.msg import Path
from referee import outcome, show
from std_msgs.msg import Bool, Float32MultiArray, Header, Int32, String

# Times: a TVal compares with both; a time and a duration do not compare with each other.
values = [genpy.Time(1, 2), genpy.Duration(1, 2), genpy.TVal(1, 2), genpy.TVal(3)]
for a in values:
    for b in values:
        outcome((a, b), lambda a=a, b=b: (a < b, a <= b, a > b, a >= b))
show(genpy.Time.__slots__, genpy.Duration.__slots__, rospy.Time.__slots__, rospy.Duration.__slots__)

# check_type is stricter than serialization.
types = [
    "int8",
    "uint8",
    "uint32",
    "float32",
    "bool",
    "string",
    "time",
    "duration",
    "Header",
    "std_msgs/Header",
]
types += [
    "std_msgs/String",
    "geometry_msgs/Point",
    "int32[]",
    "int32[2]",
    "string[]",
    "std_msgs/String[]",
    "pkg/None",
]
objects = [
    0,
    -1,
    300,
    1.5,
    "a",
    "\xe9",
    b"a",
    None,
    True,
    [],
    [1],
    ["a", 1],
    (1, 2),
    genpy.Time(1),
    genpy.Duration(1),
]
objects += [
    genpy.TVal(1),
    String("a"),
    String("\xe9"),
    String(5),
    Header(),
    Point(),
    [String()],
    [Header()],
    [True],
]
for type_ in types:
    for value in objects:
        outcome((type_, repr(value)), lambda t=type_, v=value: genpy.message.check_type("field", t, v))
for message in (
    Int32(True),
    Int32("x"),
    String("\xe9"),
    Bool(2),
    PointStamped(header=Point()),
    PoseStamped(header=5),
):
    outcome((type(message).__name__, "checked"), message._check_types)
for message in (
    Int32("x"),
    PointStamped(Header(frame_id="a"), Point("x", 0, 0)),
    PoseWithCovariance(covariance=["x"] * 36),
):
    outcome((type(message).__name__, "written"), lambda m=message: m.serialize(io.BytesIO()))

# Filling.
for kind, values in (
    (Header, [{"stamp": [1]}]),
    (Header, [{"stamp": []}]),
    (Header, [{"stamp": [1, 2, 3]}]),
    (Header, [{"stamp": {"sec": 1}}]),
    (Header, [{"stamp": {"secs": 1, "nsecs": 2}}]),
    (Header, [{"stamp": [1, 2]}]),
    (PoseStamped, [{"header": {"stamp": {"x": 1}}}]),
    (Path, [{"poses": [{"zz": 1}]}]),
    (Path, [{"poses": [{"pose": {"zz": 1}}]}]),
):
    message = kind()
    outcome(
        ("fill", kind.__name__, values), lambda m=message, v=values: genpy.message.fill_message_args(m, v)
    )
outcome("fill a class", lambda: genpy.message.fill_message_args(String, []))

# Text forms.
for value in ([1, "a"], ["a", 1], [1.5, "a b", 2], [True, "x"]):
    for width in (None, 1, 5):
        outcome(
            (value, width), lambda v=value, w=width: genpy.message.strify_message(v, fixed_numeric_width=w)
        )
show(Float32MultiArray(data=[1, "a"]))
buffer = io.StringIO()
show(genpy.message.get_printable_message_args(PoseStamped(), buff=buffer, prefix="p."))
show(repr(buffer.getvalue()))

# Classes made at run time.
line = "=" * 80
for type_, text in (
    ("a/B", "D d\n"),
    ("a/B", "in32 x"),
    ("a/B", "int32 x\nint32 x"),
    ("a/B", "int32"),
    ("a/B", f"int32 x\n{line}\nXSG: b/C\nint32 x"),
    ("a/B", f"int32 x\n{line}\n"),
    ("a/B", f"C c\n{line}\nMSG: a/C\nint32 1x\n"),
):
    outcome((type_, text), lambda t=type_, m=text: genpy.dynamic.generate_dynamic(t, m))
made = genpy.dynamic.generate_dynamic("a/B", f"C[] c\nC d\nstring s\n{line}\nMSG: a/C\nfloat64[] q\nbool b\n")
message = made["a/B"](c=[made["a/C"](q=[1.5], b=True)], s="text")
for protocol in range(2, 5):
    again = pickle.loads(pickle.dumps(message, protocol))
    show(protocol, again == message, type(again) is type(message), type(again.c[0]) is made["a/C"])
show(copy.deepcopy(message) == message, copy.copy(message).c is message.c, message)
status = DiagnosticStatus(level=b"\1", name="n", values=[KeyValue("k", "v")])
show(pickle.loads(pickle.dumps(status)) == status)
point = Point(1, 2, 3)
outcome("a shorter state", lambda: (point.__setstate__([4, 5]), point.x, point.y, point.z))
