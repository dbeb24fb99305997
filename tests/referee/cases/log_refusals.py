"""A refused connection is logged as a warning, which the level of the logger rosout hides or shows."""

import contextlib
import io
import logging
import sys
import time

import rospy
from referee import show
from std_srvs.srv import SetBool, Trigger

# Before the handlers are created, which may keep the stream.
sys.stderr = io.StringIO()
rospy.init_node("case", argv=[], log_level=rospy.WARN)
service = rospy.Service("switch", SetBool, lambda request: (True, ""))


def refused():
    with contextlib.suppress(rospy.ServiceException):
        rospy.ServiceProxy("switch", Trigger)()
    # The server is done with the first connection when it answers on the next.
    return rospy.ServiceProxy("switch", SetBool)(True).success


def lines():
    return sys.stderr.getvalue().count("Could not process inbound connection")


show("WARN", refused())
end = time.monotonic() + 20
while not lines() and time.monotonic() < end:
    time.sleep(0.01)
show(lines())
logging.getLogger("rosout").setLevel(logging.CRITICAL)
show("FATAL", refused(), lines())
