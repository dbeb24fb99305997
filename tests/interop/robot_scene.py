"""A robot in a room, for tests of the 3D view: its frames, description, sensors, map and plans, as latched messages."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from typing import Any

from geometry_msgs.msg import (
    Point,
    PointStamped,
    Polygon,
    PolygonStamped,
    Pose,
    PoseArray,
    PoseStamped,
    PoseWithCovarianceStamped,
    Quaternion,
    TransformStamped,
    Vector3,
    WrenchStamped,
)
from nav_msgs.msg import OccupancyGrid, Odometry, Path
from rospy import Time
from sensor_msgs.msg import LaserScan, PointCloud2, PointField, Range
from std_msgs.msg import ColorRGBA
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

STAMP = Time(100, 0)
HALF = 4.0  # metres, half the width of the room

_LINKS = {
    "base_link": ("0 0 0.15", "0 0 0", '<box size="0.6 0.4 0.16"/>', "0.2 0.4 0.9 1"),
    "mast": ("0 0 0.2", "0 0 0", '<cylinder radius="0.03" length="0.4"/>', "0.8 0.8 0.8 1"),
    "laser": ("0 0 0", "0 0 0", '<cylinder radius="0.06" length="0.07"/>', "0.9 0.1 0.1 1"),
    "camera": ("0 0 0", "0 0 0", '<sphere radius="0.05"/>', "0.3 0.3 0.3 1"),
    "left_wheel": ("0 0 0", "1.5708 0 0", '<cylinder radius="0.1" length="0.04"/>', "0.2 0.2 0.2 1"),
    "right_wheel": ("0 0 0", "1.5708 0 0", '<cylinder radius="0.1" length="0.04"/>', "0.2 0.2 0.2 1"),
}
_JOINTS = {
    "mast": ("fixed", "base_link", "-0.15 0 0.2"),
    "laser": ("fixed", "base_link", "0.2 0 0.27"),
    "camera": ("fixed", "mast", "0 0 0.42"),
    "left_wheel": ("continuous", "base_link", "0 0.23 0.1"),
    "right_wheel": ("continuous", "base_link", "0 -0.23 0.1"),
}


def description(extra: str = "") -> str:
    """Return the robot's URDF; ``extra`` is inserted into the link base_link."""
    parts = []
    for name, (xyz, rpy, shape, color) in _LINKS.items():
        material = f'<material name="of_{name}"><color rgba="{color}"/></material>'
        visual = f'<visual><origin xyz="{xyz}" rpy="{rpy}"/><geometry>{shape}</geometry>{material}</visual>'
        parts.append(f'<link name="{name}">{visual}{extra if name == "base_link" else ""}</link>')
    for child, (kind, parent, xyz) in _JOINTS.items():
        links = f'<parent link="{parent}"/><child link="{child}"/><origin xyz="{xyz}"/><axis xyz="0 1 0"/>'
        parts.append(f'<joint name="{child}_joint" type="{kind}">{links}</joint>')
    return f'<robot name="cart">{"".join(parts)}</robot>'


def quaternion(yaw: float) -> Quaternion:
    return Quaternion(0, 0, math.sin(yaw / 2), math.cos(yaw / 2))


def pose(x: float, y: float, yaw: float = 0.0, z: float = 0.0) -> Pose:
    return Pose(Point(x, y, z), quaternion(yaw))


def stamped(cls: type, frame: str, **fields: Any) -> Any:
    message = cls(**fields)
    message.header.frame_id = frame
    message.header.stamp = STAMP
    return message


def transform(
    parent: str, child: str, x: float, y: float, z: float = 0.0, yaw: float = 0.0
) -> TransformStamped:
    found = stamped(TransformStamped, parent, child_frame_id=child)
    found.transform.translation = Vector3(x, y, z)
    found.transform.rotation = quaternion(yaw)
    return found


def frames() -> TFMessage:
    return TFMessage(
        [
            transform("map", "odom", 0.5, 0.2, yaw=0.1),
            transform("odom", "base_link", 0.3, -0.5, yaw=0.6),
            transform("base_link", "laser", 0.2, 0, 0.27),
            transform("base_link", "mast", -0.15, 0, 0.2),
            transform("mast", "camera", 0, 0, 0.42),
            transform("base_link", "left_wheel", 0, 0.23, 0.1),
            transform("base_link", "right_wheel", 0, -0.23, 0.1),
        ]
    )


def scan() -> LaserScan:
    """Return the scanner's scan of the room, in the frame laser."""
    x, y, yaw = _laser()
    count = 540
    step = math.radians(0.5)
    ranges = []
    for index in range(count):
        angle = yaw - math.radians(135) + index * step
        dx, dy = math.cos(angle), math.sin(angle)
        ways = [(math.copysign(HALF, d) - at) / d for d, at in ((dx, x), (dy, y)) if abs(d) > 1e-9]
        ranges.append(min(ways))
    return stamped(
        LaserScan,
        "laser",
        angle_min=-math.radians(135),
        angle_max=math.radians(135),
        angle_increment=step,
        range_max=20.0,
        ranges=ranges,
        intensities=[100 + 100 * math.sin(index / 40) for index in range(count)],
    )


def _laser() -> tuple[float, float, float]:
    odom = 0.5 + 0.3 * math.cos(0.1) + 0.5 * math.sin(0.1), 0.2 + 0.3 * math.sin(0.1) - 0.5 * math.cos(0.1)
    return odom[0] + 0.2 * math.cos(0.7), odom[1] + 0.2 * math.sin(0.7), 0.7


def cloud(points: Sequence[tuple[float, float, float]] | None = None, frame: str = "map") -> PointCloud2:
    """Return a point cloud with x, y, z, intensity and rgb. Without ``points``, it is a column in the corner of the room."""
    if points is None:
        points = [
            (-2.6 + 0.5 * math.cos(angle / 20), 2.4 + 0.5 * math.sin(angle / 20), height / 40)
            for height in range(64)
            for angle in range(126)
        ]
    fields = [
        PointField(name, 4 * at, PointField.FLOAT32, 1)
        for at, name in enumerate(("x", "y", "z", "intensity", "rgb"))
    ]
    data = b"".join(
        struct.pack(
            "<4fI",
            x,
            y,
            z,
            z * 10,
            int(127 + 120 * math.sin(3 * z)) << 16 | int(127 + 120 * x / 4) << 8 | 200,
        )
        for x, y, z in points
    )
    return stamped(
        PointCloud2,
        frame,
        height=1,
        width=len(points),
        fields=fields,
        point_step=20,
        row_step=20 * len(points),
        data=data,
        is_dense=True,
    )


def grid() -> OccupancyGrid:
    resolution, cells = 0.05, 180
    found = stamped(OccupancyGrid, "map")
    found.info.resolution = resolution
    found.info.width = found.info.height = cells
    found.info.origin = pose(-4.5, -4.5)
    data = []
    for row in range(cells):
        for column in range(cells):
            x, y = -4.5 + (column + 0.5) * resolution, -4.5 + (row + 0.5) * resolution
            outside = max(abs(x), abs(y))
            data.append(-1 if outside > HALF + 0.1 else 100 if outside > HALF else 0)
    found.data = data
    return found


def path() -> Path:
    x, y, _ = _laser()
    poses = [
        stamped(PoseStamped, "map", pose=pose(x + step * 0.05, y + math.sin(step * 0.05) * 0.8))
        for step in range(50)
    ]
    return stamped(Path, "map", poses=poses)


def marker(kind: int, x: float, y: float, **fields: Any) -> Marker:
    rgb = [(0.9, 0.3, 0.2), (0.2, 0.7, 0.9), (0.9, 0.8, 0.2), (0.4, 0.8, 0.3)][kind % 4]
    found = stamped(
        Marker,
        "map",
        type=kind,
        id=kind,
        ns="shapes",
        color=ColorRGBA(*rgb, 1.0),
        scale=Vector3(0.4, 0.4, 0.4),
    )
    found.pose = pose(x, y, z=0.2)
    for name, value in fields.items():
        setattr(found, name, value)
    return found


def markers() -> MarkerArray:
    """Return one marker of each type except meshes."""
    zigzag = [Point(0.2 * step, 0.25 * (step % 2), 0) for step in range(6)]
    few = [Point(0.25 * (step % 3), 0.25 * (step // 3), 0) for step in range(6)]
    corners = [
        Point(x, y, z)
        for x, y, z in ((0, 0, 0), (0.5, 0, 0), (0, 0, 0.5), (0.5, 0, 0), (0.5, 0.5, 0), (0, 0, 0.5))
    ]
    rainbow = [ColorRGBA(step / 5, 1 - step / 5, 0.6, 1) for step in range(6)]
    thin = Vector3(0.04, 0.08, 0.1)
    return MarkerArray(
        [
            marker(Marker.ARROW, -3.2, -3.2, scale=Vector3(0.7, 0.08, 0.08)),
            marker(Marker.CUBE, -2.0, -3.2),
            marker(Marker.SPHERE, -1.0, -3.2),
            marker(Marker.CYLINDER, 0.0, -3.2),
            marker(Marker.LINE_STRIP, 0.8, -3.3, points=zigzag, scale=thin),
            marker(Marker.LINE_LIST, 2.3, -3.3, points=zigzag, scale=thin, colors=rainbow),
            marker(Marker.CUBE_LIST, -3.3, -2.2, points=few, colors=rainbow, scale=Vector3(0.2, 0.2, 0.2)),
            marker(Marker.SPHERE_LIST, -2.2, -2.2, points=few, scale=Vector3(0.2, 0.2, 0.2)),
            marker(Marker.POINTS, -1.2, -2.2, points=few, colors=rainbow, scale=Vector3(0.08, 0.08, 0)),
            marker(Marker.TEXT_VIEW_FACING, 2.6, -2.2, text="dock", scale=Vector3(0, 0, 0.35)),
            marker(Marker.TRIANGLE_LIST, 1.2, -2.3, points=corners, colors=rainbow, scale=Vector3(1, 1, 1)),
        ]
    )


def others() -> dict[str, Any]:
    """Return the messages of the remaining types, by topic."""
    odometry = stamped(Odometry, "odom")
    odometry.pose.pose = pose(0.3, -0.5, 0.6)
    odometry.pose.covariance[0] = odometry.pose.covariance[7] = 0.04
    estimate = stamped(PoseWithCovarianceStamped, "map")
    estimate.pose.pose = pose(2.6, 2.6, 2.2)
    estimate.pose.covariance[0], estimate.pose.covariance[7] = 0.2, 0.05
    particles = [pose(1.0 + 0.3 * math.sin(7 * n), 0.3 * math.cos(11 * n), math.sin(n)) for n in range(60)]
    outline = [(0.35, 0.25), (0.35, -0.25), (-0.35, -0.25), (-0.35, 0.25)]
    return {
        "/odometry": odometry,
        "/estimate": estimate,
        "/particles": stamped(PoseArray, "map", poses=particles),
        "/goal": stamped(PoseStamped, "map", pose=pose(3.2, 1.0, 1.2)),
        "/footprint": stamped(
            PolygonStamped, "base_link", polygon=Polygon([Point(x, y, 0.01) for x, y in outline])
        ),
        "/sonar": stamped(Range, "base_link", field_of_view=0.4, min_range=0.1, max_range=3.0, range=1.1),
        "/point": stamped(PointStamped, "map", point=Point(-0.5, 2.6, 0.2)),
        "/wrench": stamped(WrenchStamped, "camera", wrench=_wrench()),
    }


def _wrench() -> Any:
    from geometry_msgs.msg import Wrench

    return Wrench(Vector3(0.1, 0, 0.3), Vector3(0, 0.2, 0))


def everything() -> dict[str, Any]:
    """Return all messages by topic."""
    return {
        "/tf_static": frames(),
        "/scan": scan(),
        "/cloud": cloud(),
        "/map": grid(),
        "/plan": path(),
        "/shapes": markers(),
        **others(),
    }
