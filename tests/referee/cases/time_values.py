"""Time and Duration: creation and conversion."""

import copy
import pickle

import genpy
from referee import outcome, show
from rospy import Duration, Time

ARGUMENTS = [
    *(
        (),
        (1,),
        (1, 2),
        (0, 5),
        (5, 10**9),
        (1, 3 * 10**9 + 7),
        (1, -1),
        (0, -1),
        (-1,),
        (-1, 5),
        (-1, -1),
        (-5, 10**10),
    ),
    *(
        (1.5,),
        (1.0, 0),
        (1.5, 2),
        (-1.5,),
        (-0.1,),
        (1e-9,),
        (1e-10,),
        (-1e-10,),
        (0.1,),
        (1.9999999999999,),
        (2.7,),
    ),
    *(
        (1, 1.5),
        (1, 2.0),
        (1, "2"),
        ("a",),
        (None,),
        (1, None),
        (True,),
        ([],),
        (float("nan"),),
        (float("inf"),),
    ),
    *((2**31,), (2**32, 5), (2**40, 5), (1234567890, 123456789), (1234567890.123456789,)),
    *((Time(1),), (Duration(1),)),
]
for kind in (Time, Duration, genpy.Time, genpy.Duration):
    for arguments in ARGUMENTS:

        def about(kind=kind, arguments=arguments):
            value = kind(*arguments)
            parts = (value.secs, value.nsecs, type(value.secs).__name__, type(value.nsecs).__name__)
            return (
                repr(value),
                str(value),
                parts,
                value.to_sec(),
                value.to_nsec(),
                value.is_zero(),
                bool(value),
            )

        outcome(f"{kind.__name__}{arguments}", about)
    for seconds in (
        0,
        1,
        1.5,
        -1.5,
        -0.25,
        1e-10,
        0.1,
        1 / 3,
        1234567890.123456789,
        2**33 + 0.5,
        "1",
        None,
        True,
    ):
        outcome(
            f"{kind.__name__}.from_sec({seconds!r})",
            lambda kind=kind, seconds=seconds: kind.from_sec(seconds),
        )
for index in range(200):
    seconds = (index * 7919 % 1000) + (index * 104729 % 1000003) / 1000003
    show(
        Time(seconds),
        Time.from_sec(seconds).to_sec(),
        Duration(-seconds),
        Duration.from_sec(seconds / 1e3).to_sec(),
    )
outcome("from_seconds", lambda: Time.from_seconds(1.5))
outcome("to_time", lambda: Time(5, 500000000).to_time())
outcome("of genpy", lambda: isinstance(Time(1), genpy.Time) and isinstance(Duration(1), genpy.Duration))
for value in (Time(5, 6), Duration(-3, 1), genpy.Time(5, 6), genpy.Duration(2)):
    outcome("copy", lambda value=value: copy.copy(value))
    outcome("deepcopy", lambda value=value: copy.deepcopy(value))
    outcome("pickle", lambda value=value: pickle.loads(pickle.dumps(value)))
    outcome("format", lambda value=value: f"{value} {value!r} {value!s:>14} %s %r" % (value, value))
    outcome("format", lambda value=value: f"{value:.2f}")
    outcome("hash", lambda value=value: hash(value) == hash(copy.copy(value)))
    for function in (int, float, len, iter):
        outcome(function.__name__, lambda function=function, value=value: function(value))
time = Time(1, 2)
outcome("another attribute", lambda: setattr(time, "other", 1))
outcome("set", lambda: time.set(5, 6 * 10**9) or (time.secs, time.nsecs))
outcome("canon", lambda: time.canon() or (time.secs, time.nsecs))
time.secs = 7
outcome("assigned", lambda: (time, time == Time(7), Time.__slots__))
