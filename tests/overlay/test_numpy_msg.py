"""rospy.numpy_msg: arrays of numbers as numpy arrays, in memory and between nodes."""

from __future__ import annotations

import subprocess
import sys
from io import BytesIO
from typing import Any

import numpy
import pytest
from geometry_msgs.msg import PoseArray, TransformStamped
from nav_msgs.msg import OccupancyGrid, Odometry
from rospy.numpy_msg import numpy_msg
from sensor_msgs.msg import ChannelFloat32, Image, Imu, JointState, LaserScan, PointCloud
from std_msgs.msg import (
    ByteMultiArray,
    Float32MultiArray,
    Float64MultiArray,
    Int8MultiArray,
    Int64MultiArray,
    UInt8MultiArray,
    UInt16MultiArray,
)
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from minirospy.base.errors import SerializationError
from minirospy.base.installation import install_command
from minirospy.core.idl.load import class_from_text


def wire(message: Any) -> bytes:
    buffer = BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


@pytest.mark.parametrize(
    ("message", "path", "dtype"),
    [
        (LaserScan(ranges=[1.5, 2.0]), "ranges", "float32"),
        (LaserScan(), "ranges", "float32"),
        (Float32MultiArray(data=[1.5]), "data", "float32"),
        (Float64MultiArray(data=[1.5]), "data", "float64"),
        (Int8MultiArray(data=[-1, 2]), "data", "int8"),
        (ByteMultiArray(data=[-1, 2]), "data", "int8"),
        (UInt16MultiArray(data=[1]), "data", "uint16"),
        (Int64MultiArray(data=[1, -1]), "data", "int64"),
        (OccupancyGrid(data=[0, -1, 100]), "data", "int8"),
        (Imu(), "orientation_covariance", "float64"),
        (Odometry(), "pose.covariance", "float64"),
        (JointTrajectory(points=[JointTrajectoryPoint(positions=[1, 2.5])]), "points.0.positions", "float64"),
        (PointCloud(channels=[ChannelFloat32("a", [1.0])]), "channels.0.values", "float32"),
    ],
)
def test_received_arrays_are_numpy_arrays(message: Any, path: str, dtype: str) -> None:
    received = numpy_msg(type(message))().deserialize(wire(message))
    plain = type(message)().deserialize(wire(message))
    values, expected = received, plain

    for step in path.split("."):
        values = values[int(step)] if step.isdigit() else getattr(values, step)
        expected = expected[int(step)] if step.isdigit() else getattr(expected, step)

    assert isinstance(values, numpy.ndarray)
    assert values.dtype == dtype
    assert values.tolist() == list(expected)
    assert not values.flags.writeable
    assert wire(received) == wire(message)


def test_fields_other_than_arrays_of_numbers_stay() -> None:
    assert numpy_msg(UInt8MultiArray)().deserialize(wire(UInt8MultiArray(data=b"abc"))).data == b"abc"
    assert numpy_msg(Image)().deserialize(wire(Image(data=b"abc"))).data == b"abc"
    assert numpy_msg(JointState)().deserialize(wire(JointState(name=["a"]))).name == ["a"]
    assert len(numpy_msg(PoseArray)().deserialize(wire(PoseArray())).poses) == 0
    stamped = TransformStamped(child_frame_id="a")
    assert wire(numpy_msg(TransformStamped)().deserialize(wire(stamped))) == wire(stamped)


def test_no_number_of_python_in_between() -> None:
    """The array shares the received bytes."""
    received = numpy_msg(LaserScan)().deserialize(wire(LaserScan(ranges=[1.0, 2.0])))
    assert received.ranges.base is not None


def test_the_class_is_the_same_type_to_every_peer() -> None:
    made = numpy_msg(LaserScan)
    assert numpy_msg(LaserScan) is made
    assert numpy_msg(made) is made
    assert issubclass(made, LaserScan)
    assert (made.__name__, made.__module__) == ("Numpy_sensor_msgs__LaserScan", "rospy.numpy_msg")
    for name in ("_type", "_md5sum", "_full_text", "_slot_types", "_has_header", "__slots__"):
        assert getattr(made, name) == getattr(LaserScan, name)
    assert "ranges: [1.0, 2.0]" in str(made(ranges=numpy.array([1, 2], numpy.float32)))


@pytest.mark.parametrize(
    "values",
    [
        numpy.array([1, 2], numpy.float32),
        numpy.array([1, 2]),
        numpy.array([1.0, 2.0]),
        numpy.array([1, 9, 2], numpy.float32)[::2],
        numpy.array([1, 2], ">f4"),
        [1, 2.0],
        (1, 2),
    ],
)
def test_any_array_of_numbers_can_be_sent(values: Any) -> None:
    assert wire(numpy_msg(LaserScan)(ranges=values)) == wire(LaserScan(ranges=[1.0, 2.0]))
    assert wire(LaserScan(ranges=values)) == wire(LaserScan(ranges=[1.0, 2.0]))


def test_arrays_of_fixed_length() -> None:
    assert wire(numpy_msg(Imu)(orientation_covariance=numpy.arange(9.0))) == wire(
        Imu(orientation_covariance=[float(i) for i in range(9)])
    )
    with pytest.raises(SerializationError, match="8 values instead of 9"):
        wire(numpy_msg(Imu)(orientation_covariance=numpy.arange(8.0)))


def test_genpys_methods() -> None:
    buffer = BytesIO()
    scan = LaserScan(ranges=numpy.array([1, 2], numpy.float32))
    scan.serialize_numpy(buffer, numpy)
    assert buffer.getvalue() == wire(LaserScan(ranges=[1.0, 2.0]))
    read = LaserScan().deserialize_numpy(buffer.getvalue(), numpy)
    assert isinstance(read.ranges, numpy.ndarray)
    again = numpy_msg(LaserScan)().deserialize_numpy(buffer.getvalue(), numpy)
    assert again.ranges.tolist() == [1.0, 2.0]
    out = BytesIO()
    again.serialize_numpy(out, numpy)
    assert out.getvalue() == buffer.getvalue()


def test_a_class_that_was_made_at_run_time() -> None:
    made = class_from_text("x/Y", f"int32[] a\nz/W[] w\n{'=' * 80}\nMSG: z/W\nfloat64[2] q\nbool[] b\n")
    inner = type(made().w) and class_from_text("z/W", "float64[2] q\nbool[] b\n")
    message = made([1, 2], [inner([1.0, 2.0], [True, False])])
    read = numpy_msg(made)().deserialize(wire(message))
    assert read.a.dtype == "int32"
    assert read.w[0].q.tolist() == [1.0, 2.0]
    assert read.w[0].b.dtype == bool
    assert wire(read) == wire(message)


def test_without_numpy_it_says_so() -> None:
    code = (
        "import sys; sys.modules['numpy'] = None\n"
        "from rospy.numpy_msg import numpy_msg; from std_msgs.msg import Float32MultiArray\n"
        "try: numpy_msg(Float32MultiArray)\n"
        "except ImportError as error: print(error)"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout == f"numpy_msg needs numpy, which is not installed: {install_command('numpy')}\n"


NODE = """
import queue
import numpy, rospy
from rospy.numpy_msg import numpy_msg
from rospy_tutorials.msg import Floats

rospy.init_node("both")
heard = queue.Queue()
rospy.Subscriber("floats", numpy_msg(Floats), heard.put)
rospy.Subscriber("floats", Floats, heard.put)
pub = rospy.Publisher("floats", numpy_msg(Floats), queue_size=10)
pub.wait_for_subscribers()
pub.publish(numpy.array([1.0, 2.1, 3.2], dtype=numpy.float32))
for message in sorted([heard.get(), heard.get()], key=lambda each: type(each).__name__):
    print(type(message).__name__, type(message.data).__name__, [round(float(x), 1) for x in message.data])
"""


def test_between_nodes(master: str) -> None:
    """The example of the wiki's tutorial: a node publishes an array, and receives it."""
    out = subprocess.run(
        [sys.executable, "-c", NODE], capture_output=True, text=True, timeout=200, check=False
    )
    assert out.stdout.splitlines() == [
        "Floats tuple [1.0, 2.1, 3.2]",
        "Numpy_rospy_tutorials__Floats ndarray [1.0, 2.1, 3.2]",
    ], out.stderr
