"""The text of messages whose arrays have unusual types: other arrays, strings for bytes, tuples."""

import genpy.dynamic
import genpy.message
from referee import show
from sensor_msgs.msg import Image, PointCloud2, PointField
from std_msgs.msg import Float32MultiArray, MultiArrayDimension, UInt8MultiArray

strify = genpy.message.strify_message
array = Float32MultiArray(data=[1.0, 2.5])
array.layout.dim = [MultiArrayDimension("x", 2, 3), MultiArrayDimension("y", 2, 3)]
Odd = genpy.dynamic.generate_dynamic(
    "pkg/Odd",
    "bool[3] b\nuint8[4] u\nint8[2] i\nchar[3] c\nstring[2] s\ntime[2] t\nuint8[] v\nbool[] w\nfloat32[2] f\nbyte[2] y\n",
)["pkg/Odd"]
filled = Odd()
filled.b, filled.w, filled.v, filled.u = [True, False, True], [True, False], b"ab", b"\1\2\3\4"
filled.s = ["a", "b"]
listed = Odd()
listed.u, listed.v, listed.b = [1, 2, 3, 4], [1, 2], (1, 0, 1)
for message in (
    array, UInt8MultiArray(data=b"\1\2"), UInt8MultiArray(data=[1, 2]), Image(data="abc"), Image(data="\u00e9"),
    PointCloud2(fields=[PointField("x", 0, 7, 1)], data=b"\1\2", is_dense=True), Odd(), filled, listed,
):  # fmt: skip
    show(strify(message))
    show(strify(message, indent="  ", fixed_numeric_width=6))
