"""rosmsg-proto: messages with default values as YAML."""

from __future__ import annotations

from typing import Any


def test_messages_and_requests(command: Any) -> None:
    assert command("rosmsg_proto", "msg", "std_msgs/String") == (0, "\"data: ''\"\n", "")
    assert command("rosmsg_proto", "msg", "Vector3", "-H").out == "x: 0.0\ny: 0.0\nz: 0.0\n"
    assert command("rosmsg_proto", "srv", "-p", "> ", "-H", "SetBool").out == "> data: false\n"
    assert command("rosmsg_proto", "msg", "-f1", "Vector3").out == '"{x: 0.0, y: 0.0, z: 0.0}"\n'


def test_errors(command: Any) -> None:
    assert command("rosmsg_proto") == (64, "", "Insufficient arguments\n")
    assert command("rosmsg_proto", "xx", "String") == (1, "", "Invalid mode: .xx\n")
    result = command("rosmsg_proto", "msg", "std_msgs/Bol")
    assert (result.status, result.out) == (1, "")
    assert result.err.startswith("rosmsg-proto: ERROR: message type [std_msgs/Bol] not found; did you mean")
    assert command("rosmsg_proto", "-s", "msg", "std_msgs/Bol") == (0, "", "")


def test_fields_left_out_and_empty_arrays(command: Any) -> None:
    pose = command("rosmsg_proto", "msg", "geometry_msgs/PoseStamped", "-H", "-x", "header,orientation").out
    assert pose == "pose:\n  position:\n    x: 0.0\n    y: 0.0\n    z: 0.0\n"
    assert command("rosmsg_proto", "msg", "geometry_msgs/Polygon", "-H", "-e").out == "points: []\n"
    assert command("rosmsg_proto", "srv", "SetBool", "-x", "data").out == '"{}"\n'


def test_layouts_as_the_real_one_has_them(command: Any) -> None:
    """Bytes are not a list. After the first wide value, all values are on one line. Lines continue past column 80."""
    image = command("rosmsg_proto", "msg", "sensor_msgs/Image", "-H").out
    assert "  stamp: {secs: 0, nsecs: 0}\n" in image
    assert image.endswith('\nstep: 0\ndata: !!binary ""\n')
    grid = command("rosmsg_proto", "msg", "nav_msgs/OccupancyGrid", "-H").out
    assert "  stamp:\n    secs: 0\n" in grid
    assert grid.endswith("\n    orientation: {x: 0.0, y: 0.0, z: 0.0, w: 0.0}\ndata: [0]\n")
    pose = command("rosmsg_proto", "msg", "geometry_msgs/PoseWithCovariance", "-H").out
    numbers = ", ".join(["0.0"] * 14) + ",\n  " + ", ".join(["0.0"] * 16) + ",\n  " + ", ".join(["0.0"] * 6)
    assert pose.endswith(f"\ncovariance: [{numbers}]\n")
