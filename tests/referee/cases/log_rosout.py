"""/rosout: the location fields of a message."""

import logging

import rospy
from referee import eventually, show
from rosgraph_msgs.msg import Log
from std_msgs.msg import Bool

rospy.init_node("case", argv=["__ns:=/somewhere"])
rosout = logging.getLogger("rosout")
rosout.removeHandler(rosout.handlers[0])  # the terminal's handler
got = []
rospy.Subscriber("/rosout", Log, got.append)
publisher = rospy.Publisher("here", Bool, queue_size=1)
eventually(lambda: rospy.loginfo("probe") or len(got) > 0)


class Robot:
    def drive(self):
        rospy.logwarn("method")
        rospy.logwarn_once("once")
        rospy.logwarn_throttle(100, "throttle")
        rospy.logwarn_throttle_identical(100, "identical")
        nameless = lambda: rospy.logwarn("lambda")  # noqa: E731 - its name is what is asked
        nameless()

    @staticmethod
    def stop():
        rospy.logwarn("static method")

    @classmethod
    def build(cls):
        rospy.logwarn("class method")

    def __call__(self):
        def inner():
            rospy.logwarn("inner")

        def inner_with_self():
            rospy.logwarn("inner of %s", type(self).__name__)

        inner()
        inner_with_self()


class Arm(Robot):
    pass


def function(self):
    rospy.logwarn("function of self")


got.clear()
rospy.loginfo("info")
rospy.logwarn("warn")
rospy.logerr("error")
rospy.logfatal("fatal")
rospy.loginfo("args %s %d", "x", 3)
rospy.loginfo("two\nlines \u00e4\u20ac\U0001f600")
rospy.loginfo(None)
rospy.loginfo("")
rospy.loginfo("named", logger_name="x.y")
Robot().drive()
Robot.stop()
Robot.build()
Robot()()
Arm().drive()
function(5)
rosout.warning("python")
try:
    raise ValueError("v")
except ValueError:
    rospy.logerr("error", exc_info=True)
rospy.logdebug("not sent")
rospy.loginfo("last")
eventually(lambda: len(got) > 0 and got[-1].msg == "last")
first = got[0].header.seq
for message in got:
    if message.msg == "probe":
        first += 1
        continue
    show(
        message.header.seq - first,
        repr(message.header.frame_id),
        message.header.stamp.secs > 1e9,
        message.level,
    )
    show("  ", message.name, repr(message.msg), message.file, message.function, message.line)
    show("  ", sorted(message.topics))
show(rospy.get_published_topics("/") and [t for t in rospy.get_published_topics("/") if t[0] == "/rosout"])
