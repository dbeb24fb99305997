"""Time before init_node, and without simulated time."""

import threading
import time

import rospy
from referee import of_ten_looks, outcome, show
from rosgraph_msgs.msg import Clock

for name, call in [
    ("get_time", rospy.get_time),
    ("get_rostime", rospy.get_rostime),
    ("Time.now", rospy.Time.now),
    ("Rate", lambda: rospy.Rate(1)),
    ("sleep", lambda: rospy.sleep(0.001)),
    ("sleep for a Duration", lambda: rospy.sleep(rospy.Duration(0, 1000))),
    ("sleep for nothing", lambda: rospy.sleep(0)),
    ("sleep backwards", lambda: rospy.sleep(-1)),
]:
    outcome(name, call)
rospy.set_param("/use_sim_time", True)
rospy.init_node("case", argv=[], disable_rostime=True)
publisher = rospy.Publisher("/clock", Clock, queue_size=1, latch=True)
publisher.publish(Clock(rospy.Time(5)))
show("wall time, whatever use_sim_time says", rospy.get_time() > 1e9, type(rospy.get_time()))
show(rospy.Time.now() > rospy.Time(10**9), *of_ten_looks(lambda: (abs(rospy.get_time() - time.time()) < 1,)))
for duration in (0, -1, 0.05, 0.05 / 3, rospy.Duration(0, 50_000_000), rospy.Duration(-1)):
    outcome(f"sleep {duration!r}", lambda duration=duration: rospy.sleep(duration))
    wanted = duration.to_sec() if isinstance(duration, rospy.Duration) else duration

    def sleeps_so_long(duration=duration, wanted=wanted):
        began = time.monotonic()
        rospy.sleep(duration)
        return (max(wanted, 0) <= time.monotonic() - began < max(wanted, 0) + 0.3,)

    show(*of_ten_looks(sleeps_so_long))
for duration in ("1", None, rospy.Time(1), []):
    try:
        rospy.sleep(duration)
    except TypeError:
        show("TypeError", duration)
slept = []
threads = [threading.Thread(target=lambda: slept.append(rospy.sleep(0.1))) for _ in range(5)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
show(slept)
rospy.signal_shutdown("")
outcome("sleep after shutdown", lambda: rospy.sleep(0.01))
outcome("Rate after shutdown", lambda: rospy.Rate(100).sleep())
show("time after shutdown", rospy.get_time() > 1e9)
