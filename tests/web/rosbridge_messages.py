"""Messages that were sent through the real rosbridge_websocket (rosbridge_suite, branch ros1), and its recorded output."""

from __future__ import annotations

from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from sensor_msgs.msg import CameraInfo, Image, LaserScan, PointCloud2, PointField
from std_msgs.msg import (
    Bool,
    Byte,
    Char,
    Empty,
    Float32,
    Float64,
    Float64MultiArray,
    Header,
    Int8MultiArray,
    Int64MultiArray,
    String,
    UInt8MultiArray,
    UInt16MultiArray,
)
from std_msgs.msg import Duration as DurationMessage
from tf2_msgs.msg import TFMessage

from minirospy.base.times import Duration, Time

__all__ = ["MESSAGES"]

_NAN, _INF = float("nan"), float("inf")
_TRANSFORM = TransformStamped(
    Header(0, Time(3, 4), "a"), "b", Transform(Vector3(1.5, 0, 0), Quaternion(0, 0, 0, 1))
)

MESSAGES: dict[str, Any] = {
    "scan": LaserScan(ranges=[1.5, _NAN, _INF, -_INF], header=Header(1, Time(2, 3), "ä")),
    "image": Image(height=1, width=2, encoding="rgb8", step=6, data=b"\0\1\2\xff\xfe\3"),
    "camera": CameraInfo(K=[1.0] * 9, D=[0.1, 0.2]),
    "text": String('zażółć "\n'),
    "tf": TFMessage([_TRANSFORM, _TRANSFORM]),
    "diagnostics": DiagnosticArray(status=[DiagnosticStatus(level=1, name="x", values=[KeyValue("a", "b")])]),
    "int64": Int64MultiArray(data=[1, -(2**40)]),
    "uint16": UInt16MultiArray(data=[1, 65535]),
    "bool": Bool(True),
    "float32": Float32(0.1),
    "duration": DurationMessage(Duration(-1, 5)),
    "char": Char(7),
    "byte": Byte(-3),
    "cloud": PointCloud2(fields=[PointField("x", 0, 7, 1)], data=b"1234"),
    "empty": Empty(),
    "nan": Float64(_NAN),
    "int8": Int8MultiArray(data=[-1, 2]),
    "uint8": UInt8MultiArray(data=[1, 2]),
    "float64": Float64MultiArray(data=[1.0, _NAN]),
}
