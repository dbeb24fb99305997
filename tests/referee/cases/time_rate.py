"""Rate on wall time."""

import time

import rospy
from referee import of_ten_looks, outcome, show

rospy.init_node("case", argv=[])
for hz in (
    10,
    2.5,
    1e-3,
    1e9,
    1e10,
    float("inf"),
    -1,
    -2.5,
    0,
    0.0,
    "10",
    None,
    float("nan"),
    rospy.Duration(1),
):
    outcome(
        f"Rate({hz!r})", lambda hz=hz: (rospy.Rate(hz).sleep_dur, type(rospy.Rate(hz).sleep_dur).__name__)
    )
outcome("Rate(-1).sleep", lambda: rospy.Rate(-1).sleep())
outcome("Rate(inf).sleep", lambda: rospy.Rate(float("inf")).sleep())


def took(call):
    began = time.monotonic()
    call()
    return time.monotonic() - began


rate = rospy.Rate(10)
show(type(rate.last_time).__name__, type(rate.remaining()).__name__, sorted(vars(rate)))


def ten_turns():
    for _ in range(10):
        time.sleep(0.03)
        rate.sleep()


def late_by_little():
    time.sleep(0.13)
    return took(rate.sleep) < 0.04, took(rate.sleep) < 0.09


def late_by_much():
    time.sleep(0.55)
    return took(rate.sleep) < 0.04, took(rate.sleep) > 0.06


def remaining():
    rate = rospy.Rate(1)
    time.sleep(0.3)
    return (0.5 < rate.remaining().to_sec() < 0.71,)


def another_turn():
    rate.last_time = rospy.Time.now()
    return (0.03 < took(rate.sleep) < 0.2,)


show("no drift", *of_ten_looks(lambda: (0.95 < took(ten_turns) < 1.2,)))
show("late by little: two short turns", *of_ten_looks(late_by_little))
show("late by much: one, and a new beginning", *of_ten_looks(late_by_much))
show("remaining", *of_ten_looks(remaining))
rate = rospy.Rate(1)
time.sleep(1)
show("none remaining", rate.remaining() < rospy.Duration(0))
rate.last_time = rospy.Time.now() + rospy.Duration(100)
show("from the future", 0.9 < rate.remaining().to_sec() <= 1.0)
rate.sleep_dur = rospy.Duration(0, 50_000_000)
show("another turn", *of_ten_looks(another_turn))
show("reset", *of_ten_looks(lambda: (0.15 < took(rospy.Rate(5, reset=True).sleep) < 0.4,)))
outcome("by name", lambda: rospy.Rate(hz=5, reset=False).sleep_dur)
