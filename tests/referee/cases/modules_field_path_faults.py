"""rostopic.msgevalgen with an index or a slice of a field that is no array, and with a step of 0."""

import contextlib
import io

import rostopic
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from referee import outcome, show
from sensor_msgs.msg import LaserScan
from std_msgs.msg import String

SCAN = LaserScan(ranges=[1.0, 2.0, 3.0])
STATUSES = DiagnosticArray(status=[DiagnosticStatus(name="abc")])
for message, paths in (
    (String("abc"), "data[::0] data[0:1:0] nope[::0] data[0]"),
    (
        SCAN,
        "ranges[::0] ranges[0:0:0] header/stamp[0] angle_min[0] angle_min[0:1] angle_min[::0] header[0] header[::]",
    ),
    (
        STATUSES,
        "status[:]/level[0] status[:]/name[::0] status[::0]/name status[0]/level[0] status[0]/name[0]",
    ),
):
    for path in paths.split():
        with contextlib.redirect_stderr(io.StringIO()) as errors:
            outcome(path, lambda: rostopic.msgevalgen("/" + path)(message))
        show(repr(errors.getvalue()))
