"""Improvements of minirospy's time over rospy's; tests/referee compares the common behaviour."""

from __future__ import annotations

import re
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


LOG = """
import logging, re, sys
class Handler(logging.Handler):
    def emit(self, record):
        print(record.levelname, re.sub(" at 0x[0-9a-f]+", "", record.getMessage().replace("\\n", "|")), flush=True)
def print_log():
    logging.getLogger("rosout").handlers[:] = [Handler()]
"""


def test_timer_continues_when_simulated_time_jumps_back() -> None:
    program = f"""
{LOG}
import rospy.rostime
rospy.set_param("/use_sim_time", True)
rospy.init_node("case")
print_log()
rospy.rostime._set_rostime(rospy.Time(100000))
events = []
called = threading.Semaphore(0)
def callback(event):
    events.append(event)
    called.release()
timer = rospy.Timer(rospy.Duration(1), callback)
second = 100000
while not called.acquire(timeout=0.05):  # the timer's thread may not have started
    second -= 1000
    rospy.rostime._set_rostime(rospy.Time(second))
timer_starts = second
while not called.acquire(timeout=0.05):
    second += 1
    rospy.rostime._set_rostime(rospy.Time(second))
print(timer.is_alive(), events[0].current_expected.secs == events[0].current_real.secs == timer_starts)
print((events[1].current_expected - events[0].current_expected).to_sec())
"""
    said = run(program)
    assert re.fullmatch(
        r"WARNING simulated time jumped back by \d+\.000 s: the Timer of <function callback> starts its period again",
        said[0],
    )
    assert said[1:] == ["True True", "1.0"]


def test_timer_continues_after_an_error_of_its_callback() -> None:
    program = f"""
{LOG}
rospy.init_node("case")
print_log()
called = threading.Semaphore(0)
def callback(event):
    called.release()
    raise ValueError("a fault")
timer = rospy.Timer(rospy.Duration(0.01), callback)
for _ in range(4):
    called.acquire()
print(timer.is_alive(), flush=True)
timer.shutdown()
timer.join()
once = rospy.Timer(rospy.Duration(0.01), callback, oneshot=True)
once.join()
print(once.is_alive(), flush=True)
rospy.signal_shutdown("")
"""
    said = run(program)
    assert said[0].startswith("ERROR bad callback: <function callback>|Traceback (most recent call last):|")
    assert said[0].endswith("|ValueError: a fault|")
    assert said[1:3] == ["True", "False"]
    # The errors are counted, and the count is logged at the shutdown.
    assert re.fullmatch(
        r"ERROR bad callback: <function callback>: ValueError: a fault \(\d+ more times; the first one is logged above\)",
        said[3],
    )
    assert len(said) == 4


def test_exit_in_a_callback_ends_its_timer_alone() -> None:
    program = f"""
{LOG}
rospy.init_node("case")
print_log()
called = threading.Semaphore(0)
other = rospy.Timer(rospy.Duration(0.01), lambda _: called.release())
def callback(event):
    sys.exit(3)
timer = rospy.Timer(rospy.Duration(0.01), callback)
timer.join(30)
for _ in range(3):
    called.acquire()
print(timer.is_alive(), other.is_alive(), rospy.is_shutdown())
"""
    assert run(program) == [
        "ERROR Timer ends: its callback <function callback> called sys.exit(3)",
        "False True False",
    ]


@pytest.mark.parametrize(
    "sleep",
    [
        "rospy.sleep(1)",
        "rospy.Rate(1).sleep()",
        "rospy.Timer(rospy.Duration(1), print, oneshot=True).join()",
    ],
)
def test_sleep_without_clock_names_it_once(sleep: str) -> None:
    program = f"""
{LOG}
from minirospy.base import clock
import rospy.rostime
clock.SILENT_SECONDS = 0.1
rospy.set_param("/use_sim_time", True)
rospy.init_node("case")
print_log()
logged = threading.Event()
class Handler(logging.Handler):
    def emit(self, record):
        logged.set()
logging.getLogger("rosout").addHandler(Handler())
for _ in range(2):
    threading.Thread(target=lambda: {sleep}, daemon=True).start()
logged.wait()
threading.Event().wait(0.5)
"""
    assert run(program) == [
        "WARNING /use_sim_time is set, and no time has arrived on /clock yet: sleep(), Rate and Timer wait for it. Start the "
        "simulator or `rosbag play --clock`; or type `rosparam set use_sim_time false`, and restart this node"
    ]
