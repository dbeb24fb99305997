"""Timer on wall time."""

import itertools
import threading
import time

import rospy
from referee import eventually, of_ten_looks, outcome, show

rospy.init_node("case", argv=[])
threading.excepthook = lambda args: errors.append((args.exc_type.__name__, str(args.exc_value)))
errors = []
events = []


def called(event):
    events.append(event)
    if len(events) == 2:
        time.sleep(0.02)
    if len(events) == 4:
        threading.current_thread().shutdown()


def four_times():
    events.clear()
    timer = rospy.Timer(rospy.Duration(0.1), called)
    said[:] = timer.daemon, timer.is_alive(), isinstance(timer, threading.Thread)
    timer.join(30)
    said.extend(["ended", timer.is_alive(), len(events)])
    late = [(event.current_real - event.current_expected).to_sec() for event in events]
    return max(late) < 0.08, events[2].last_duration < 0.1, events[3].last_duration < 0.01


said = []
of_ten_looks(four_times)
show(*said[:3])
show(*said[3:])
for before, event in zip([None, *events], events, strict=False):
    show(sorted(vars(event)))
    show(*(type(getattr(event, name)).__name__ for name in sorted(vars(event))))
    show((event.current_real - event.current_expected).to_sec() < 0.08)
    if before:
        show(event.last_expected == before.current_expected, event.last_real == before.current_real)
        show((event.current_expected - event.last_expected).to_sec())
show("last_duration", 0.015 < events[2].last_duration < 0.1, events[3].last_duration < 0.01)

calls = []
timer = rospy.Timer(rospy.Duration(0.05), calls.append, oneshot=True)
timer.join(30)
show("oneshot", len(calls), timer.is_alive())
for period in (rospy.Duration(0), rospy.Duration(-1), rospy.Duration(0, 1), rospy.Duration(1e-3)):
    calls.clear()
    timer = rospy.Timer(period, calls.append, oneshot=True)
    timer.join(30)
    show("period", period, len(calls), timer.is_alive(), errors)
    errors.clear()
for period in (0.1, 1, None):
    rospy.Timer(period, calls.append).join(30)
    show("period", period, errors)
    errors.clear()
rospy.Timer(rospy.Duration(0.01), 5).join(30)
show("no function", errors)
chain = []


def again(event):
    chain.append(threading.current_thread().daemon)
    if len(chain) < 3:
        rospy.Timer(rospy.Duration(0.02), again, oneshot=True)


rospy.Timer(rospy.Duration(0.02), again, True)
show("from its own callback", eventually(lambda: len(chain) == 3), chain)
slow = []


def busy(event):
    slow.append(event.current_real)
    time.sleep(0.25)


timer = rospy.Timer(rospy.Duration(0.1), busy)
eventually(lambda: len(slow) == 3)
timer.shutdown()
timer.join(30)
show("one call at a time", all((b - a).to_sec() > 0.24 for a, b in itertools.pairwise(slow)))


timers = []


def shut_down_early():
    calls.clear()
    timers.append(rospy.Timer(period=rospy.Duration(0.2), callback=calls.append, oneshot=False, reset=True))
    timers[-1].shutdown()
    time.sleep(0.4)
    return (not calls,)


of_ten_looks(shut_down_early)
show("shut down before the first", calls)
outcome("again", timers[-1].shutdown)
forever = rospy.Timer(rospy.Duration(0.01), calls.append)
eventually(lambda: calls)
rospy.signal_shutdown("")
forever.join(30)
show("ends with the node", forever.is_alive())
