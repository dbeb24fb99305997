"""Field paths: parsing them, following them into messages, and their types."""

from __future__ import annotations

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point32, PolygonStamped, PoseStamped
from sensor_msgs.msg import JointState, LaserScan

from minirospy.base.errors import NotFoundError, UsageError
from minirospy.introspect.fields import Step, field_type, field_value, parse_path


def test_paths_are_parsed() -> None:
    assert parse_path("") == ()
    assert parse_path("a/b") == (Step("a", None), Step("b", None))
    assert parse_path("a[0]/b") == (Step("a", 0), Step("b", None))
    assert parse_path("a[-1]") == (Step("a", -1),)
    assert parse_path("a[1:3]") == (Step("a", slice(1, 3)),)
    assert parse_path("a[::2]") == (Step("a", slice(None, None, 2)),)
    assert parse_path("a[3:0:-1]") == (Step("a", slice(3, 0, -1)),)
    assert parse_path("a[:]/x") == (Step("a", slice(None, None)), Step("x", None))


@pytest.mark.parametrize(
    "path", ["a[", "a[]", "a[x]", "a[1.5]", "a//b", "[0]", "a/", "a[1][2]", "a b", "a[::0]", "a[1:2:3:4]"]
)
def test_malformed_path_is_refused(path: str) -> None:
    with pytest.raises(UsageError, match=r"field path \["):
        parse_path(path)


def test_values_are_found() -> None:
    polygon = PolygonStamped()
    polygon.header.frame_id = "map"
    polygon.polygon.points = [Point32(1, 2, 3), Point32(4, 5, 6)]

    def value(path: str) -> object:
        return field_value(polygon, parse_path(path))

    assert value("") is polygon
    assert value("header/frame_id") == "map"
    assert value("polygon/points[1]/x") == 4
    assert value("polygon/points[-1]") == Point32(4, 5, 6)
    assert value("polygon/points[:]/y") == [2, 5]
    assert value("polygon/points[1:]") == [Point32(4, 5, 6)]
    assert value("header/stamp/secs") == 0


def test_strings_have_indices_and_slices() -> None:
    joints = JointState(name=["alpha", "beta", ""])
    joints.header.frame_id = "map"

    def value(path: str) -> object:
        return field_value(joints, parse_path(path))

    assert value("header/frame_id[0:2]") == "ma"
    assert value("header/frame_id[-1]") == "p"
    assert value("header/frame_id[::-1]") == "pam"
    assert value("name[0]") == "alpha"
    assert value("name[1:]") == ["beta", ""]
    with pytest.raises(IndexError, match=r"frame_id\[3\]: the string has 3 characters"):
        value("header/frame_id[3]")


def test_elements_without_the_rest_of_a_path_are_none_and_reported() -> None:
    values = [KeyValue("k", "v"), KeyValue("k2", "v2")]
    message = DiagnosticArray(
        status=[DiagnosticStatus(name="abc", values=values), DiagnosticStatus(name="d")]
    )
    reported: list[Exception] = []

    def value(path: str) -> object:
        return field_value(message, parse_path(path), reported.append)

    assert value("status[:]/values[1]/key") == ["k2", None]
    assert [str(each) for each in reported] == ["values[1]: the array has 0 elements"]
    assert value("status[:]/values[:]/key[:1]") == [["k", "k"], []]
    assert value("status[:]/name[1]") == ["b", None]
    assert value("status[:]/nope") == [None, None]
    assert len(reported) == 4
    # Without a report, and for the first step, the error is raised.
    with pytest.raises(IndexError):
        field_value(message, parse_path("status[:]/values[1]/key"))
    with pytest.raises(IndexError):
        value("status[5]/name")


def test_missing_field_is_reported() -> None:
    scan = LaserScan(ranges=[1.0])
    with pytest.raises(NotFoundError, match=r"field \[range\] not found; did you mean ranges"):
        field_value(scan, parse_path("range"))
    with pytest.raises(IndexError, match=r"ranges\[3\]: the array has 1 elements"):
        field_value(scan, parse_path("ranges[3]"))
    with pytest.raises(NotFoundError, match="single float"):
        field_value(scan, parse_path("range_max[0]"))


def test_fields_are_typed() -> None:
    assert field_type(PoseStamped, "") == "geometry_msgs/PoseStamped"
    assert field_type(PoseStamped, "pose/position/x") == "float64"
    assert field_type(PoseStamped, "header/stamp") == "time"
    assert field_type(PoseStamped, "header/stamp/secs") == "uint32"
    assert field_type(PolygonStamped, "polygon/points") == "geometry_msgs/Point32[]"
    assert field_type(PolygonStamped, "polygon/points[0]/x") == "float32"
    with pytest.raises(NotFoundError, match=r"\[geometry_msgs/Point\] has x y z"):
        field_type(PoseStamped, "pose/position/w")
    with pytest.raises(NotFoundError, match=r"\[time\] has secs nsecs"):
        field_type(PoseStamped, "header/stamp/sec")


def test_a_field_of_an_array_needs_an_element() -> None:
    polygon = PolygonStamped()
    polygon.polygon.points = [Point32(1, 2, 3)]
    for find in (
        lambda: field_type(PolygonStamped, "polygon/points/x"),
        lambda: field_value(polygon, parse_path("polygon/points/x")),
    ):
        with pytest.raises(
            NotFoundError, match=r"points\[0\]/x is that of its first element, points\[:\]/x of all"
        ):
            find()
