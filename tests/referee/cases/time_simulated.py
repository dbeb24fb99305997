"""Simulated time: sleeping, Rate, Timer; time that jumps back."""

import threading

import rospy
from referee import Other, eventually, is_waiting, outcome, show

CLOCK = """
import rospy
import sys
from rosgraph_msgs.msg import Clock
rospy.init_node("clock", disable_rostime=True)
publisher = rospy.Publisher("/clock", Clock, queue_size=10, latch=True)
print("ready", flush=True)
for line in sys.stdin:
    publisher.publish(Clock(rospy.Time(float(line))))
"""
threading.excepthook = lambda args: errors.append((args.exc_type.__name__, str(args.exc_value)))
errors = []
rospy.set_param("/use_sim_time", True)
clock = Other(CLOCK)
clock.read()
rospy.init_node("case", argv=[])
show("before the first", rospy.get_time(), rospy.Time.now(), rospy.Rate(10).remaining())


def at(seconds):
    clock.process.stdin.write(f"{seconds}\n")
    clock.process.stdin.flush()
    show("at", seconds, eventually(lambda: rospy.get_time() == seconds))


class Sleeper(threading.Thread):
    """Sleeps in a thread; ``end()`` prints how the sleep ended."""

    def __init__(self, label, sleep):
        super().__init__(daemon=True)
        self.label, self.sleep, self.outcome = label, sleep, None
        self.start()
        eventually(lambda: is_waiting(self) or not self.is_alive())

    def run(self):
        try:
            self.outcome = "returned", self.sleep()
        except rospy.ROSTimeMovedBackwardsException as error:
            self.outcome = type(error).__name__, str(error), error.time, isinstance(error, KeyboardInterrupt)
        except rospy.ROSException as error:
            self.outcome = type(error).__name__, str(error)

    def sleeping(self):
        self.join(0.15)
        show("  ", self.label, "sleeps", self.is_alive())

    def end(self):
        self.join(30)
        show("  ", self.label, self.outcome, rospy.get_time())


sleeper = Sleeper("until there is a time", lambda: rospy.sleep(1))
sleeper.sleeping()
at(10)
sleeper.sleeping()
at(10.5)
sleeper.sleeping()
at(11)
sleeper.end()
for duration in (0, -1, rospy.Duration(0), rospy.Duration(-5)):
    Sleeper(f"{duration!r}", lambda duration=duration: rospy.sleep(duration)).end()
sleeper = Sleeper("a Duration", lambda: rospy.sleep(rospy.Duration(2)))
at(12)
sleeper.sleeping()
at(13.25)
sleeper.end()

sleeper = Sleeper("back within the sleep", lambda: rospy.sleep(4))
at(16)
sleeper.sleeping()
at(14)
sleeper.sleeping()
at(17.25)
sleeper.end()
sleeper = Sleeper("back to before it", lambda: rospy.sleep(4))
at(19)
sleeper.sleeping()
at(13.25)
sleeper.end()

events, again = [], []
sleepers = [
    Sleeper("sleep", lambda: rospy.sleep(2)),
    Sleeper("Rate", lambda: rospy.Rate(0.5).sleep()),
    Sleeper("Rate with reset", lambda: rospy.Rate(0.5, reset=True).sleep()),
]
timer_again = rospy.Timer(rospy.Duration(1), again.append, reset=True)
eventually(lambda: is_waiting(timer_again))
at(5)
for sleeper in sleepers:
    sleeper.end()
show("Timer with reset", timer_again.is_alive(), eventually(lambda: len(again) == 1))
for count, seconds in enumerate((6, 7, 8.5), 2):
    eventually(lambda: is_waiting(timer_again))
    at(seconds)
    show("  ", eventually(lambda count=count: len(again) == count))
timer_again.shutdown()
for event in again:
    show("  ", event.last_expected, event.last_real, event.current_expected, event.current_real)

at(9)
rate = rospy.Rate(1)
sleeper = Sleeper("a turn", rate.sleep)
at(9.5)
sleeper.sleeping()
at(10)
sleeper.end()
show("  ", rate.last_time)
at(15)
Sleeper("late", rate.sleep).end()
show("  ", rate.last_time)
at(14)
show("back between two turns", rate.remaining(), rate.last_time)
sleeper = Sleeper("a turn", rate.sleep)
at(14.5)
sleeper.sleeping()
at(15.25)
sleeper.end()
show("  ", rate.last_time, rate.remaining())
sleeper = Sleeper("back to nothing", lambda: rospy.sleep(5))
at(0)
sleeper.end()
outcome("now", rospy.Time.now)
show(clock.close())
