"""rospy.rostime: a time without a node, and one that a program sets."""

import time

import rospy
import rospy.rostime as rostime
from referee import outcome, show

show(rostime.is_wallclock(), rostime.is_rostime_initialized())
outcome("now", lambda: rospy.Time.now())
outcome("wallsleep", lambda: rostime.wallsleep(0.01))
outcome("wallsleep", lambda: rostime.wallsleep(-1))
rostime.set_rostime_initialized(True)
outcome("now", lambda: abs(rospy.Time.now().to_sec() - time.time()) < 2)
outcome("get_time", lambda: abs(rospy.get_time() - time.time()) < 2)
show(rostime.is_wallclock(), rostime.is_rostime_initialized())
rostime._set_rostime(rospy.Time(5))
outcome("now", lambda: rospy.Time.now())
outcome("get_time", lambda: rostime.get_time())
show(rostime.is_wallclock(), rostime.is_rostime_initialized())
rostime.switch_to_wallclock()
outcome("now", lambda: abs(rospy.Time.now().to_sec() - time.time()) < 2)
outcome("Rate", lambda: rospy.Rate(1000).sleep())
rostime.set_rostime_initialized(False)
outcome("now", lambda: rospy.Time.now())
outcome("not a time", lambda: rostime._set_rostime(5))
rospy.init_node("n", argv=[])
show(rostime.is_wallclock(), rostime.is_rostime_initialized())
