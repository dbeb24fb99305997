"""Time and Duration: arithmetic, comparison, refused operands."""

import operator

import genpy
from referee import outcome
from rospy import Duration, Time

VALUES = {
    "Time(5,6)": Time(5, 6),
    "Time(0)": Time(0),
    "Duration(2,7)": Duration(2, 7),
    "Duration(-3,1)": Duration(-3, 1),
    "Duration(0)": Duration(0),
    "genpy.Time(5,6)": genpy.Time(5, 6),
    "genpy.Duration(2,7)": genpy.Duration(2, 7),
    "3": 3,
    "0": 0,
    "-1": -1,
    "2.5": 2.5,
    "0.0": 0.0,
    "True": True,
    "'s'": "s",
    "None": None,
}
ADDING = [operator.add, operator.sub, operator.mul, operator.truediv, operator.floordiv]
COMPARING = [operator.eq, operator.ne, operator.lt, operator.le, operator.gt, operator.ge]


def both(operation, a, b):
    result = operation(a, b)
    return type(result).__name__, result


for operation in [*ADDING, *COMPARING]:
    for left, a in VALUES.items():
        for right, b in VALUES.items():
            if isinstance(a, genpy.TVal) or isinstance(b, genpy.TVal):
                label = f"{left} {operation.__name__} {right}"
                outcome(label, lambda operation=operation, a=a, b=b: both(operation, a, b))
for operation in (operator.mod, divmod):
    for right in ("genpy.Duration(2,7)", "3", "2.5", "Time(5,6)", "None"):
        for left in ("Duration(2,7)", "Duration(0)", "Time(5,6)"):
            a, b = VALUES[left], VALUES[right]
            outcome(
                f"{left} {operation.__name__} {right}",
                lambda operation=operation, a=a, b=b: both(operation, a, b),
            )
for operation in (operator.neg, operator.abs, operator.pos, operator.invert):
    for label, value in VALUES.items():
        if isinstance(value, genpy.TVal):
            outcome(
                f"{operation.__name__} {label}", lambda operation=operation, value=value: operation(value)
            )
outcome("as keys", lambda: {genpy.Time(5, 6): 1, genpy.Duration(5, 6): 2}[Time(5, 6)])
outcome("min and max", lambda: (min(Time(1), Time(2)), max(Duration(1), Duration(3))))
outcome("sum", lambda: sum([Duration(1), Duration(2, 5)], Duration()))
outcome("sorted", lambda: sorted([Time(3), Time(1, 5), Time(1)]))
outcome("below the epoch", lambda: Time(1) - Duration(2))
outcome("below the epoch", lambda: Time(1) + Duration(-2))
outcome("large", lambda: Time(2**32 - 1, 999999999) + Duration(0, 1))
outcome("large", lambda: Duration(2**31 - 1) * 3)
time = Time(1)
time += Duration(1, 5)
outcome("+=", lambda: time)
time -= Duration(0, 6)
outcome("-=", lambda: time)
