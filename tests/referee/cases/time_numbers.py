"""Times made from various numbers: numpy's, fractions, strings."""

import decimal
import fractions
import operator

import genpy
import numpy
import rospy
from referee import outcome, show

NUMBERS = {
    "int64": numpy.int64(3),
    "int32": numpy.int32(3),
    "uint8": numpy.uint8(200),
    "float32": numpy.float32(1.5),
    "float64": numpy.float64(1.5),
    "a tenth": numpy.float32(0.1),
    "negative": numpy.float32(-1.5),
    "array": numpy.array(1.5),
    "True": True,
    "Fraction": fractions.Fraction(3, 2),
    "Decimal": decimal.Decimal("1.5"),
    "text": "1",
    "None": None,
    "nan": float("nan"),
    "inf": float("inf"),
}


def made(kind, *numbers):
    time = kind(*numbers)
    return str(time), type(time.secs).__name__, type(time.nsecs).__name__


for kind in (rospy.Duration, rospy.Time, genpy.Duration, genpy.Time):
    for name, number in NUMBERS.items():
        label = f"{kind.__module__}.{kind.__name__} {name}"
        outcome(label, lambda number=number: made(kind, number))
        outcome(f"{label}, 5", lambda number=number: made(kind, number, 5))
        outcome(f"{label} from_sec", lambda number=number: str(kind.from_sec(number)))
two = rospy.Duration(2)
for name in ("int64", "float64", "True"):
    for operation in (operator.mul, operator.truediv, operator.floordiv):
        outcome(f"{operation.__name__} {name}", lambda: str(operation(two, NUMBERS[name])))
    outcome(f"{name} of it", lambda: str(NUMBERS[name] * two))
rospy.rostime.set_rostime_initialized(True)
for hz in (numpy.float32(50), numpy.int64(50), True, fractions.Fraction(50)):
    outcome(f"Rate {float(hz)}", lambda: str(rospy.Rate(hz).sleep_dur))
show(str(rospy.Time.from_sec(numpy.float64(1.25)) + rospy.Duration(numpy.float32(0.5))))
