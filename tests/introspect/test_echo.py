"""The output of `rostopic echo`, which equals the real one's byte for byte, and messages from YAML values."""

from __future__ import annotations

from io import BytesIO
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point, Point32, Polygon, PoseStamped
from rosbridge_library import msg as rosbridge
from sensor_msgs.msg import CameraInfo, Image, JointState
from std_msgs.msg import Bool, Empty, String
from visualization_msgs.msg import Marker, MarkerArray

from minirospy.base.errors import DeserializationError, MessageException, NotFoundError, UsageError
from minirospy.introspect.echo import Echo, Filter, fill_message
from minirospy.introspect.messages import MessageClasses, Received
from minirospy.introspect.topics import TopicField


def received(message: Any, **header: str) -> Received:
    buffer = BytesIO()
    message.serialize(buffer)
    fields = {"type": message._type, "md5sum": message._md5sum, "message_definition": message._full_text}
    return Received(buffer.getvalue(), {**fields, **header}, 1500000000123456789)


def echo(message: Any, path: str = "", **options: Any) -> str:
    one = Echo(TopicField("/t", message._type, path), **options)
    packet = received(message)
    return one.text(one.message(packet), packet)


def test_a_message_ends_with_a_rule() -> None:
    assert echo(Bool(True)) == "data: True\n---\n"
    assert echo(String("hello\nworld")) == 'data: "hello\\nworld"\n---\n'
    assert echo(Empty()) == "\n---\n"


def test_fields_and_arrays() -> None:
    polygon = Polygon([Point32(1.0, 2.0, 3.0), Point32(4.0, 5.0, 6.0)])
    assert echo(polygon, "points[0]/x") == "1.0\n---\n"
    assert echo(polygon, "points[:]/x") == "[1.0, 4.0]\n---\n"
    assert echo(polygon, "points") == (
        "\n- \n  x: 1.0\n  y: 2.0\n  z: 3.0\n- \n  x: 4.0\n  y: 5.0\n  z: 6.0\n---\n"
    )
    assert echo(Image(data=b"\x01\xff"), "data") == "[1, 255]\n---\n"
    assert echo(PoseStamped(), "header/stamp") == "\nsecs: 0\nnsecs:         0\n---\n"


def test_paths_into_strings_and_elements_that_differ() -> None:
    reported: list[Exception] = []
    status = DiagnosticStatus(name="abc", values=[KeyValue("k", "v"), KeyValue("k2", "v2")])
    message = DiagnosticArray(status=[status, DiagnosticStatus(name="defg")])
    assert echo(message, "status[:]/name[0:2]") == "\n- ab\n- de\n---\n"
    assert echo(message, "status[:]/name[0:2]", arrays=False) == "\n- ab\n- de\n---\n"
    assert echo(message, "status[:]/name[0:2]", strings=False) == '"<string length: 2>"\n---\n'
    assert echo(message, "status[:]/values[:]/key") == "\n- \n  - k\n  - k2\n- []\n---\n"
    assert echo(message, "status[:]/values[0]/key", report=reported.append) == "\n- k\n- null\n---\n"
    assert [str(each) for each in reported] == ["values[0]: the array has 0 elements"]


def test_notes_in_the_place_of_arrays_and_strings() -> None:
    image = Image(data=b"abc", encoding="rgb8")
    assert 'encoding: "rgb8"\n' in echo(image, arrays=False)
    assert echo(image, arrays=False).endswith('data: "<array type: uint8, length: 3>"\n---\n')
    assert 'encoding: "<string length: 4>"\n' in echo(image, strings=False)
    joints = JointState(name=["a", "b"], position=[1.5])
    assert 'name: "<array type: string, length: 2>"\nposition: [1.5]\n' in echo(joints, strings=False)


def test_notes_are_as_ros_writes_them() -> None:
    """Messages in arrays are printed completely; the note for an array with a fixed length keeps its bracket."""
    info = CameraInfo()
    assert 'K: "<array type: float64[9, length: 9>"\n' in echo(info, arrays=False)
    markers = MarkerArray([Marker(ns="n", text="t")])
    assert '    ns: "n"\n' in echo(markers, strings=False)


def test_a_field_of_char_is_printed_as_bytes() -> None:
    assert echo(rosbridge.TestChar(data=b"xy"), "data") == "b'xy'\n---\n"


def test_plotting_has_one_header() -> None:
    one = Echo(TopicField("/t", "std_msgs/Bool", ""), plot=True)
    packet = received(Bool(True))
    assert one.text(one.message(packet), packet) == "%time,field.data\n1500000000123456789,1\n"
    assert one.text(one.message(packet), packet) == "1500000000123456789,1\n"


def test_plotting_takes_the_time_of_the_header() -> None:
    pose = PoseStamped()
    pose.header.stamp.secs = 3
    assert echo(pose, plot=True).splitlines()[1].startswith("3000000000,")


def test_unknown_field_is_reported_before_the_first_message() -> None:
    with pytest.raises(NotFoundError, match="did you mean pose"):
        echo(PoseStamped(), "poes")


def test_a_type_that_is_not_installed_comes_from_the_publishers_text() -> None:
    packet = Received(
        b"\x02\x00\x00\x00\x05\x00\x00\x00\x03\x00\x00\x00abc\x07\x00\x00\x00",
        {
            "type": "far_away_msgs/Thing",
            "md5sum": "0123",
            "message_definition": "Point[] ids\nfar_away_msgs/Name name\nint32 n\n" + "=" * 80
            + "\nMSG: far_away_msgs/Point\nint16 x\n" + "=" * 80 + "\nMSG: far_away_msgs/Name\nstring data",
        },
        0,
    )  # fmt: skip
    one = Echo(TopicField("/t", "far_away_msgs/Thing", ""))
    message = one.message(packet)
    assert message.n == 7
    assert one.text(message, packet) == (
        'ids: \n  - \n    x: 5\n  - \n    x: 0\nname: \n  data: "abc"\nn: 7\n---\n'
    )


def test_type_without_definition_is_reported() -> None:
    with pytest.raises(NotFoundError, match="not installed"):
        MessageClasses().for_header({"type": "far_away_msgs/Thing", "md5sum": "0123"})


def test_bytes_that_do_not_fit_are_refused() -> None:
    packet = received(String("hello"))._replace(body=b"\x05\x00\x00\x00he")
    with pytest.raises(DeserializationError):
        MessageClasses().read(packet)


def test_filters() -> None:
    assert Filter("m.data and topic == '/t'")(Bool(True), "/t")
    assert not Filter("m.data")(Bool(False), "/t")
    with pytest.raises(UsageError, match="not a Python expression"):
        Filter("m.(")
    with pytest.raises(UsageError, match="AttributeError"):
        Filter("m.datum")(Bool(True), "/t")


def test_messages_from_values() -> None:
    assert fill_message(Bool, [{"data": True}]) == Bool(True)
    assert fill_message(Bool, [True]) == Bool(True)
    assert fill_message(Point, [1, 2, 3]) == Point(1, 2, 3)
    assert fill_message(Empty, []) == Empty()
    pose = fill_message(PoseStamped, [{"header": "auto", "pose": {"position": {"x": 3}}}])
    assert pose.header.stamp.secs > 1500000000
    assert pose.pose.position.x == 3
    assert fill_message(PoseStamped, [{"header": {"stamp": "now"}}]).header.stamp.secs > 1500000000


@pytest.mark.parametrize(
    ("cls", "values", "why"),
    [
        (Bool, [{"datum": True}], r"No field name \[datum\].*std_msgs/Bool\] has bool data"),
        (Point, [1], "Not enough arguments"),
        (Bool, [True, False], "Too many arguments"),
        (Point, [1, 2, "a"], "z must be float"),
        (String, [5], "data must be"),
        (PoseStamped, [{"header": "soon"}], "soon"),
        (PoseStamped, [{"header": {"stamp": [1]}}], r"Expected: \['secs', 'nsecs'\]"),
    ],
)
def test_values_that_do_not_fit_are_one_line(cls: type[Any], values: list[Any], why: str) -> None:
    with pytest.raises(MessageException, match=why) as caught:
        fill_message(cls, values)
    assert "\n" not in str(caught.value)


def test_notes_in_the_place_of_a_field_name_its_type() -> None:
    joints = JointState(name=["a", "b"])
    assert echo(joints, "name", arrays=False) == '"<array type: string, length: 2>"\n---\n'
    assert echo(joints, "name", strings=False) == '"<array type: string, length: 2>"\n---\n'
    polygon = Polygon([Point32()])
    assert echo(polygon, "points", arrays=False) == '"<array type: geometry_msgs/Point32, length: 1>"\n---\n'


def test_times_as_offsets_from_now() -> None:
    pose = PoseStamped()
    pose.header.stamp.secs = 12
    assert (
        echo(pose, "header/stamp", offset=True, now=lambda: 10 * 10**9)
        == "\nsecs: 2\nnsecs:         0\n---\n"
    )
    row = echo(pose, plot=True, offset=True, now=lambda: 10 * 10**9).splitlines()[1]
    assert row.startswith("2000000000,0,2000000000,")
