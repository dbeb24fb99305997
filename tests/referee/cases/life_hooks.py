"""Shutdown hooks: their order, their permitted actions, and their arguments."""

import sys
import threading

import rospy
from referee import outcome, show
from std_msgs.msg import Bool


def hook(name):
    def call(*reason):
        show(name, reason, rospy.is_shutdown(), rospy.core.is_shutdown_requested(), rospy.core.is_initialized(),
             threading.current_thread() is threading.main_thread())  # fmt: skip

    return call


def failing():
    show("failing")
    raise ValueError("no")


def exiting():
    show("exiting")
    sys.exit(3)


def busy():
    outcome("   publish", lambda: publisher.publish(True))
    outcome("   sleep", lambda: rospy.sleep(0.01))
    outcome("   get_param", lambda: rospy.get_param("/x", 1))
    outcome("   Publisher", lambda: type(rospy.Publisher("t2", Bool, queue_size=1)).__name__)
    outcome("   Subscriber", lambda: type(rospy.Subscriber("t2", Bool, print)).__name__)
    outcome("   signal_shutdown", lambda: rospy.signal_shutdown("again"))
    outcome("   on_shutdown", lambda: rospy.on_shutdown(hook("added by a hook")))


rospy.on_shutdown(hook("before init_node"))
rospy.init_node("case", argv=[])
publisher = rospy.Publisher("t", Bool, queue_size=1)
rospy.core.add_preshutdown_hook(hook("pre"))
rospy.core.add_shutdown_hook(hook("after"))
rospy.on_shutdown(hook("1"))
rospy.core.add_client_shutdown_hook(hook("2"))
for function in (failing, exiting, busy):
    rospy.on_shutdown(function)
rospy.on_shutdown(hook("3"))
outcome("signal_shutdown", lambda: rospy.signal_shutdown("because"))
show(rospy.is_shutdown(), rospy.core.is_shutdown_requested())
outcome("late on_shutdown", lambda: rospy.on_shutdown(hook("late")))
outcome("late add_preshutdown_hook", lambda: rospy.core.add_preshutdown_hook(hook("late pre")))
outcome("late add_shutdown_hook", lambda: rospy.core.add_shutdown_hook(hook("late after")))
outcome("no reason", rospy.signal_shutdown)
outcome("again", lambda: rospy.signal_shutdown("again"))
