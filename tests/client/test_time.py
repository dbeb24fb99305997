"""Improvements of minirospy's time over rospy's; tests/referee compares the common behaviour."""

from __future__ import annotations

import subprocess
import sys

import pytest

pytestmark = pytest.mark.usefixtures("master")


def run(program: str) -> list[str]:
    """Return the output lines of a program that exits soon and with 0."""
    done = subprocess.run(
        [sys.executable, "-c", "import rospy, threading\n" + program],
        capture_output=True,
        text=True,
        timeout=30,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout.splitlines()


def test_timer_stops_immediately_at_shutdown() -> None:
    program = """
rospy.init_node("case")
timer = rospy.Timer(rospy.Duration(1000), print)
timer.shutdown()
timer.join(30)
print(timer.is_alive())
other = rospy.Timer(rospy.Duration(1000), print)
rospy.signal_shutdown("")
other.join(30)
print(other.is_alive())
"""
    assert run(program) == ["False", "False"]


def test_a_shutdown_ends_every_sleep() -> None:
    program = """
rospy.init_node("case")
ends = []
def sleeps(sleep):
    try:
        ends.append(sleep())
    except rospy.ROSInterruptException as error:
        ends.append(str(error))
threads = [threading.Thread(target=sleeps, args=[sleep]) for sleep in (lambda: rospy.sleep(1000), rospy.Rate(0.001).sleep)]
for thread in threads:
    thread.start()
rospy.signal_shutdown("")
for thread in threads:
    thread.join()
print(ends)
rospy.sleep(0.01)
rospy.Rate(100).sleep()
print("who has asked for it may clean up")
"""
    assert run(program) == [
        "['ROS shutdown request', 'ROS shutdown request']",
        "who has asked for it may clean up",
    ]


def test_sleepers_wake_up_when_simulated_time_ends() -> None:
    program = """
import rospy.rostime
rospy.set_param("/use_sim_time", True)
rospy.init_node("case")
rospy.rostime._set_rostime(rospy.Time(5))
thread = threading.Thread(target=rospy.sleep, args=[1], daemon=True)
thread.start()
thread.join(0.1)
rospy.rostime.switch_to_wallclock()
thread.join(30)
print(thread.is_alive(), rospy.get_time() > 1e9)
"""
    assert run(program) == ["False True"]


def test_error_in_simulated_time_is_logged_when_a_timer_stops() -> None:
    program = """
import rospy.rostime
threading.excepthook = lambda args: print(args.exc_type.__name__, args.exc_value)
rospy.set_param("/use_sim_time", True)
rospy.init_node("case")
rospy.rostime._set_rostime(rospy.Time(100000))
timer = rospy.Timer(rospy.Duration(1), print)
second = 100000
while timer.is_alive():  # it may not have started
    second -= 1
    rospy.rostime._set_rostime(rospy.Time(second))
    timer.join(0.05)
"""
    assert run(program) == ["ROSTimeMovedBackwardsException ROS time moved backwards"]


@pytest.mark.parametrize(
    ("statement", "lines"),
    [
        ("sys.exit(3)", ["Timer ends: its callback <function callback> called sys.exit(3)"]),
        ("raise ValueError('a fault')", ["ValueError: a fault"]),
    ],
)
def test_error_of_a_callback_ends_its_timer_alone(statement: str, lines: list[str]) -> None:
    program = f"""
import logging, re, sys
threading.excepthook = lambda args: print(f"{{args.exc_type.__name__}}: {{args.exc_value}}")
rospy.init_node("case")
class Handler(logging.Handler):
    def emit(self, record):
        print(re.sub(" at 0x[0-9a-f]+", "", record.getMessage()))
log = logging.getLogger("rosout")
log.handlers[:] = [Handler()]
called = threading.Semaphore(0)
other = rospy.Timer(rospy.Duration(0.01), lambda _: called.release())
def callback(event):
    {statement}
timer = rospy.Timer(rospy.Duration(0.01), callback)
timer.join(30)
for _ in range(3):
    called.acquire()
print(timer.is_alive(), other.is_alive(), rospy.is_shutdown())
"""
    assert run(program) == [*lines, "False True False"]
