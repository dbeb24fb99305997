"""Rows for plotting tools, as printed by real `rostopic echo -p`."""

from __future__ import annotations

import genpy
from geometry_msgs.msg import Point32, Polygon
from sensor_msgs.msg import Image, JointState
from std_msgs.msg import Bool, Duration, Empty, Time

from minirospy.introspect.plot import plot_header, plot_row


def test_scalars() -> None:
    assert plot_header(Bool(True)) == "%time,field.data"
    assert plot_row(Bool(True), 5) == "5,1"
    assert plot_row(Duration(genpy.Duration(-2, 500000000)), 5) == "5,-1500000000"
    assert plot_header(Empty()) == "%time,"
    assert plot_row(Empty(), 5) == "5,"


def test_arrays_are_columns_and_bytes_are_left_out() -> None:
    polygon = Polygon([Point32(1.0, 2.0, 3.0), Point32(4.0, 5.0, 6.0)])
    assert plot_header(polygon) == (
        "%time,field.points0.x,field.points0.y,field.points0.z,field.points1.x,field.points1.y,field.points1.z"
    )
    assert plot_row(polygon, 7) == "7,1.0,2.0,3.0,4.0,5.0,6.0"
    assert plot_header([1.0, 2.0]) == "%time,field0,field1"
    assert plot_header(Image(data=b"abc")) == (
        "%time,field.header.seq,field.header.stamp,field.header.frame_id,field.height,field.width,"
        "field.encoding,field.is_bigendian,field.step"
    )


def test_strings_and_arrays_can_be_left_out() -> None:
    joints = JointState(name=["a", "b c"], position=[1.0])
    assert plot_row(joints, 1) == "1,0,0,,a,b c,1.0"
    assert plot_row(joints, 1, strings=False) == "1,0,0,1.0"
    assert plot_row(joints, 1, arrays=False) == "1,0,0,"
    # The value of a path is not a field of a message.
    assert plot_row(joints.name, 1, strings=False, arrays=False) == "1,a,b c"
    assert plot_row([joints], 1, strings=False) == "1,0,0,1.0"


def test_missing_value_keeps_its_column() -> None:
    assert plot_header(["k", None, "v"]) == "%time,field0,field1,field2"
    assert plot_row(["k", None, "v"], 1) == "1,k,,v"


def test_times_from_an_origin() -> None:
    assert plot_row(Time(genpy.Time(5, 7)), 3, origin=5) == "3,5000000002"
    assert plot_row(Duration(genpy.Duration(5, 7)), 3, origin=5) == "3,5000000007"
