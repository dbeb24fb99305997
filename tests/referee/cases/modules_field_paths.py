"""Paths with indices and slices of strings and of arrays whose elements differ, and how nested lists are printed."""

import contextlib
import io

import genpy
import rostopic
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point
from referee import show
from sensor_msgs.msg import Image, JointState
from std_msgs.msg import Int32MultiArray, String

STATUS = DiagnosticStatus(name="abc", values=[KeyValue("k", "v"), KeyValue("k2", "v2")])
DIAGNOSTICS = DiagnosticArray(status=[STATUS, DiagnosticStatus(level=1, name="defg")])
JOINTS = JointState(name=["alpha", "beta"], position=[1.0, 2.0])
IMAGE = Image(data=b"\x01\x02\xff", encoding="rgb8")

PATHS = """
data[0:2] data[0] data[9] data[1:] data[::2] data[-1] data[-9] data[::-1] data[0:2]/x data[0]/x data/x
"""
OF_JOINTS = "name[0] name[0:2] name[5] name/x name[:]/x name[0]/x position[0:9] position[9] position[:]/x nope nope[0]"
OF_DIAGNOSTICS = """
status[:]/name status[:]/name[0:2] status[:]/name[3] status[0]/name[1:] status[:]/values[0]/key
status[:]/values[0]/value[0:1] status[:]/values[:]/key status[:]/values[:]/key[0] status[:]/nope
status[:]/values[:]/nope status[1:]/values[0] status[:]/values[5]/key status[9]/name status/name status[:]/level
status[0:0]/name status[0]/values[0:1]/key[:1] status[1:]/values
"""
OF_IMAGE = "data[0] data[0:2] data[9] data[:]/x encoding[0:3]"
OF_NUMBERS = "data[0] data[0:2] data[:]/x layout/dim[0] layout/dim[:]/size"

for message, paths in (
    (String("hello"), PATHS),
    (JOINTS, OF_JOINTS),
    (DIAGNOSTICS, OF_DIAGNOSTICS),
    (IMAGE, OF_IMAGE),
    (Int32MultiArray(data=[1, 2, 3]), OF_NUMBERS),
):
    show("#", message._type)
    for path in paths.split():
        with contextlib.redirect_stderr(io.StringIO()) as errors:
            value = rostopic.msgevalgen("/" + path)(message)
        show(path, repr(value), repr(errors.getvalue()))

show("# printed")
for value in (
    [["k", "k2"], []],
    [[], ["k"]],
    [[1, 2], [3]],
    [None],
    ["a", None],
    [None, "a"],
    [1, None],
    [[None]],
    [["a", None]],
    [Point(1, 2, 3), None],
    [None, Point(1, 2, 3)],
    ["a", ["b"]],
    [["a"], "b"],
    [[genpy.Time(1, 2)]],
    [[Point(1, 2, 3)], []],
    [[["a"]]],
    [[""], ["a"]],
    [True, None],
):
    for options in ({}, {"indent": "  "}, {"fixed_numeric_width": 6}):
        show(repr(value), options, repr(genpy.message.strify_message(value, **options)))
