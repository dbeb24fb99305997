"""Field paths: parsing them, following them into messages, and their types."""

from __future__ import annotations

import pytest
from geometry_msgs.msg import Point32, PolygonStamped, PoseStamped
from sensor_msgs.msg import LaserScan

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
