"""_once, _throttle and _throttle_identical, with simulated time."""

import logging

import rospy
from referee import eventually, outcome, show
from rosgraph_msgs.msg import Clock

rospy.set_param("/use_sim_time", True)
rospy.init_node("case", argv=[])
publisher = rospy.Publisher("/clock", Clock, queue_size=1, latch=True)
rosout = logging.getLogger("rosout")
rosout.removeHandler(rosout.handlers[0])  # the terminal's handler
rosout.setLevel(logging.DEBUG)
lines = []


class Keep(logging.Handler):
    def emit(self, record):
        if record.name.startswith("rosout") and record.getMessage().startswith("my"):
            lines.append(record.levelname[:1] + " " + record.getMessage())


rosout.addHandler(Keep())


def said(label):
    show(label, lines)
    lines.clear()


for i in range(3):
    rospy.loginfo_once("my once")
    rospy.logwarn_once("my once %d", i)
    rospy.logerr_once("my a"), rospy.logerr_once("my b")
    rospy.logdebug_once("my named", logger_name="x")
    rospy.logfatal_once("my fatal")
said("once")


def of_two(text):
    rospy.loginfo_once("my " + text)


of_two("first")
of_two("second")
said("one place, two texts")


def throttled(text):
    rospy.loginfo_throttle(10, "my throttle %s", text)
    rospy.logwarn_throttle(2.5, "my shorter")


def identical(text):
    rospy.loginfo_throttle_identical(10, "my identical " + text)
    rospy.loginfo_throttle_identical(10, "my format %s", text)


for time in (5, 9, 15, 15.5, 25.25, 25.5, 25.75, 3, 4, 13, 13.5, 0, 26):
    publisher.publish(Clock(rospy.Time(time)))
    eventually(lambda time=time: rospy.get_time() == time)
    throttled(str(time))
    said(f"at {time}")
    identical("even" if int(time) % 2 == 0 else "odd")
    said("  identical")
for period in (0, -1, 0.0):
    for _ in range(2):
        rospy.loginfo_throttle(period, "my period")
        rospy.loginfo_throttle_identical(period, "my identical period")
    said(f"period {period}")
for name in ("debug", "info", "warn", "err", "fatal"):
    for kind in ("_throttle", "_throttle_identical"):
        for _ in range(2):
            getattr(rospy, f"log{name}{kind}")(10, "my %s %s", name, kind)
said("levels")
outcome("no period", lambda: rospy.loginfo_throttle("text"))
