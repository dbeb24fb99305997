"""Another node in the process of one that has shut down: programs reset rospy's modules for it."""

import os
import threading

os.environ["ROSCONSOLE_FORMAT"] = "${message}"

import rospy
from referee import outcome, show
from std_msgs.msg import Int32


def live(name):
    rospy.init_node(name, argv=[], disable_rosout=True, disable_signals=True)
    rospy.on_shutdown(lambda: show("hook of", name))
    rospy.loginfo("once")
    show(rospy.get_name(), rospy.is_shutdown(), rospy.core.is_initialized(), rospy.client._init_node_args[0])
    rospy.set_param("~p", 1)
    show(rospy.has_param(f"/{name}/p"))
    ticks = threading.Event()
    timer = rospy.Timer(rospy.Duration(0.01), lambda event: ticks.set())
    show("timer", ticks.wait(60))
    rospy.signal_shutdown("end")
    timer.join(60)
    show(timer.is_alive(), rospy.is_shutdown(), rospy.core.is_shutdown_requested())


def begin_again():
    rospy.core._shutdown_flag = False
    rospy.core._in_shutdown = False
    rospy.client._init_node_args = None
    show(rospy.is_shutdown(), rospy.core.is_shutdown_requested(), rospy.client._init_node_args)


live("one")
outcome("again", lambda: rospy.init_node("two", argv=[], disable_signals=True))
begin_again()
live("one")
begin_again()
live("two")
publisher = rospy.Publisher("late", Int32, queue_size=1)
outcome("publish", lambda: publisher.publish(1))
