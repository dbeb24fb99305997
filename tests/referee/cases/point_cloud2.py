"""sensor_msgs.point_cloud2: which points are read, in which order, and refused clouds."""

import hashlib
import struct

import rospy
from referee import outcome, show
from sensor_msgs import point_cloud2
from sensor_msgs.msg import Image, PointCloud2, PointField
from std_msgs.msg import Header

NAN = float("nan")


def cloud(fmt, rows, fields, row_padding=0, point_padding=0, big=False):
    """Return a cloud of rows of points, with unused bytes after each point and each row."""
    point = struct.Struct((">" if big else "<") + fmt)
    data = b""
    for row in rows:
        data += b"".join(point.pack(*each) + b"\x7f" * point_padding for each in row) + b"\x7f" * row_padding
    step = point.size + point_padding
    fields = [PointField(name, offset, datatype, count) for name, offset, datatype, count in fields]
    width = len(rows[0]) if rows else 0
    return PointCloud2(
        height=len(rows),
        width=width,
        fields=fields,
        is_bigendian=big,
        point_step=step,
        row_step=step * width + row_padding,
        data=data,
    )


def summary(points):
    """Return the number of points, the first ones, and a hash of all."""
    points = list(points)
    return f"{len(points)} {points[:2]} {hashlib.md5(repr(points).encode()).hexdigest()}"


XYZ = [("x", 0, 7, 1), ("y", 4, 7, 1), ("z", 8, 7, 1)]
MIXED = [
    ("stamp", 12, 8, 1),
    ("x", 0, 7, 1),
    ("ring", 4, 4, 1),
    ("label", 6, 2, 2),
    ("id", 8, 6, 1),
    ("tiny", 20, 1, 1),
]


def xyz(width, height, **kwargs):
    rows = [[(v, u, NAN if (u + v) % 5 == 3 else u * v / 4) for u in range(width)] for v in range(height)]
    return cloud("fff", rows, XYZ, **kwargs)


def mixed(width, height, **kwargs):
    rows = [[(u / 2, v, 1, 2, 70000 + u, u + v / 8, -u % 100) for u in range(width)] for v in range(height)]
    return cloud("fHBBIdb", rows, MIXED, **kwargs)


for make in (xyz, mixed):
    for width, height in ((0, 0), (0, 3), (3, 0), (1, 1), (7, 3), (40, 30), (1, 200), (200, 1)):
        for padding in (
            {},
            {"point_padding": 4},
            {"row_padding": 5},
            {"point_padding": 3, "row_padding": 7},
            {"big": True},
        ):
            made = make(width, height, **padding)
            texts = [
                summary(point_cloud2.read_points(made, names, skip))
                for names in (None, ("x",), ("z", "x"), ["ring", "x", "id"], "xy")
                for skip in (False, True)
            ]
            counts = [text.partition(" ")[0] for text in texts]
            show(
                make.__name__,
                width,
                height,
                padding,
                *counts,
                hashlib.md5("".join(texts).encode()).hexdigest(),
            )
            if width * height:
                uvs = [(width - 1, height - 1), (0, 0), (width // 2, 0)]
                show(
                    "uvs",
                    summary(point_cloud2.read_points(made, uvs=uvs)),
                    summary(point_cloud2.read_points(made, None, True, uvs)),
                )

made = xyz(40, 3)
points = point_cloud2.read_points(made)
show(type(points).__name__, next(points), next(points), type(next(points)).__name__, points.close())
named = point_cloud2.read_points_list(made, ("x", "y"))
show(type(named).__name__, len(named), named[1], named[1].y, type(named[1]).__name__, named[1]._fields)
show(
    point_cloud2.read_points_list(made, skip_nans=True)[4], point_cloud2.read_points_list(made, uvs=[(1, 1)])
)
show(point_cloud2.read_points_list(mixed(2, 1), ("x", "ring")), point_cloud2.read_points_list(xyz(0, 0)))
outcome("two values for one name", lambda: point_cloud2.read_points_list(mixed(2, 1)))
outcome("a name that is none", lambda: point_cloud2.read_points_list(made, ("x", "9")))
outcome("an unknown field", lambda: list(point_cloud2.read_points(made, ("q",)))[:2])

# Fields that overlap are read one after the other.
overlapping = cloud("ffII", [[(1, 2, 3, 4)] * 80], [("a", 0, 7, 1), ("b", 8, 6, 1), ("c", 8, 6, 1)])
show(summary(point_cloud2.read_points(overlapping)))
# A field without values, a last point that ends early, a step that is shorter than a point, no step.
show(summary(point_cloud2.read_points(cloud("ff", [[(1, 2)] * 80], [("a", 0, 7, 0), ("b", 4, 7, 1)]))))
short = xyz(40, 3, point_padding=4)
short.data = short.data[:-4]
show(summary(point_cloud2.read_points(short)))
short.data = short.data[:-4]
points = point_cloud2.read_points(short)
seen = []
try:
    while True:
        seen.append(next(points))
except struct.error as error:
    show(len(seen), error)
dense = cloud("fff", [[(1, 2, 3)] * 80], XYZ)
dense.point_step = 4
dense.width = 60
show(summary(point_cloud2.read_points(dense)))
dense.point_step = 0
show(summary(point_cloud2.read_points(dense)))

outcome("no cloud", lambda: next(point_cloud2.read_points(Image())))
outcome("no message", lambda: next(point_cloud2.read_points(None)))
outcome("no cloud", lambda: point_cloud2.read_points_list(Image()))
listed = xyz(10, 10)
listed.data = list(listed.data)
outcome("a list", lambda: next(point_cloud2.read_points(listed)))
show(
    point_cloud2._get_struct_fmt(False, made.fields),
    point_cloud2._get_struct_fmt(True, mixed(1, 1).fields, ("x", "id", "stamp")),
)
show(sorted(point_cloud2._DATATYPES.items()))


def made_of(points, fields=None):
    header = Header(frame_id="f")
    if fields is None:
        result = point_cloud2.create_cloud_xyz32(header, points)
    else:
        result = point_cloud2.create_cloud(header, [PointField(*each) for each in fields], points)
    shown = (
        result.height,
        result.width,
        result.is_dense,
        result.is_bigendian,
        result.point_step,
        result.row_step,
        result.header.frame_id,
    )
    return (
        *shown,
        [(f.name, f.offset, f.datatype, f.count) for f in result.fields],
        bytes(result.data).hex(),
    )


show(made_of([]), made_of([(1, 2, 3), [4.5, -5, NAN]]), made_of(((1, 2, 3),)))
show(made_of([(1.5, 2, 3, 4, 5, 6, -7)], MIXED))
show(made_of([(1, 2)], [("b", 8, 7, 1), ("a", 2, 4, 1)]))
for points in (
    [(1, 2)],
    [(1, 2, 3, 4)],
    [(1, 2, "3")],
    [(1, 2, 1e300)],
    [1, 2],
    [(1, 2, 3), (1,)],
    5,
    iter([(1, 2, 3)]),
):
    outcome(type(points).__name__, lambda: made_of(points))
outcome("fractions", lambda: made_of([(1.5,)], [("a", 0, 4, 1)]))
try:
    made_of([(70000,)], [("a", 0, 4, 1)])
except struct.error:
    # Its text depends on the version of Python.
    show("too large raises struct.error")
