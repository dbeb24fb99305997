"""laser_geometry: the bytes of the clouds of scans, with every option."""

import hashlib
import random

import laser_geometry
from laser_geometry import LaserProjection
from referee import outcome, show
from sensor_msgs.msg import LaserScan

NAN, INF = float("nan"), float("inf")
OPTION = LaserProjection.ChannelOption
show(sorted((name, value) for name, value in vars(OPTION).items() if name.isupper()))
show([getattr(LaserProjection, f"LASER_SCAN_{name}") for name in ("INVALID", "MIN_RANGE", "MAX_RANGE")])
show(sorted(name for name in dir(laser_geometry) if not name.startswith("_")))


def scan(count=10, **changed):
    """Return a scan with ranges at and beyond its limits."""
    made = LaserScan(
        angle_min=-1.0, angle_max=1.0, angle_increment=2.0 / max(1, count - 1), time_increment=0.001
    )
    made.range_min, made.range_max = 0.1, 10.0
    made.ranges = [1.0, 0.05, 11.0, NAN, INF, 10.0, 0.1, 3.0, -1, -INF][:count]
    made.intensities = [float(each) for each in range(count)]
    made.header.frame_id, made.header.seq = "laser", 4
    for name, value in changed.items():
        setattr(made, name, value)
    return made


def described(cloud):
    """Return all fields of a cloud except its header's time."""
    fields = [(field.name, field.offset, field.datatype, field.count) for field in cloud.fields]
    data = bytes(cloud.data).hex()
    numbers = cloud.height, cloud.width, cloud.point_step, cloud.row_step, cloud.is_dense, cloud.is_bigendian
    return (
        cloud.header.frame_id,
        cloud.header.seq,
        *numbers,
        fields,
        data if len(data) < 400 else hashlib.sha256(cloud.data).hexdigest(),
    )


projection = LaserProjection()


def project(*arguments, **options):
    """Print the cloud for these arguments."""
    show(arguments[1:], options, described(projection.projectLaser(*arguments, **options)))


for count in (10, 5, 1, 0):
    project(scan(count))
for options in range(33):
    project(scan(), -1.0, options)
for cutoff in (0, 2.0, 0.01, 20.0, -1, -5, 1e9, NAN):
    project(scan(), cutoff)
for intensities in ([], (7.0,) * 12):
    project(scan(intensities=intensities), -1.0, 31)
project(scan(ranges=tuple([1.0] * 10)), range_cutoff=2.0, channel_options=OPTION.INTENSITY | OPTION.DISTANCE)
project(scan(angle_min=0.5, range_max=INF), 50.0)
project(scan(range_min=INF))

drawn = random.Random(3)
for count in (3, 360, 1081):
    ranges = [drawn.uniform(-1, 12) for _ in range(count)]
    project(
        scan(count, ranges=ranges, angle_min=-2.35, angle_max=2.35, angle_increment=4.7 / count), -1.0, 31
    )

for wrong in (None, "scan"):
    outcome("wrong", lambda wrong=wrong: projection.projectLaser(wrong))
