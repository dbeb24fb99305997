"""Waiting for a service: the exceptions, and the duration."""

import logging
import threading
import time

import rosgraph
import rospy
from referee import outcome, show
from std_srvs.srv import Trigger, TriggerResponse

rospy.init_node("case", argv=[])


class Lines(logging.Handler):
    def emit(self, record):
        show("  log", record.name, record.levelname, record.getMessage())


logging.getLogger("rosout").addHandler(Lines())


def timed(label, call, low, high):
    start = time.monotonic()
    outcome(label, call)
    show("   in time", low <= time.monotonic() - start < high)


service = rospy.Service("there", Trigger, lambda request: TriggerResponse(True, "x"))
timed("there", lambda: rospy.wait_for_service("there"), 0, 30)
timed("there, global", lambda: rospy.wait_for_service("/there"), 0, 30)
timed("there, with timeout", lambda: rospy.wait_for_service("there", 60), 0, 30)
timed("there, keyword", lambda: rospy.wait_for_service(service="there", timeout=60.0), 0, 30)
timed("there, Duration", lambda: rospy.wait_for_service("there", rospy.Duration(60)), 0, 30)
timed("proxy", lambda: rospy.ServiceProxy("there", Trigger).wait_for_service(), 0, 30)
timed("proxy, with timeout", lambda: rospy.ServiceProxy("there", Trigger).wait_for_service(timeout=60), 0, 30)
timed("absent", lambda: rospy.wait_for_service("absent", 0.5), 0.5, 30)
timed("absent, global", lambda: rospy.wait_for_service("/a/b", timeout=0.3), 0.3, 30)
timed("absent, Duration", lambda: rospy.wait_for_service("absent", rospy.Duration(0, 400000000)), 0.4, 30)
timed("absent, proxy", lambda: rospy.ServiceProxy("absent", Trigger).wait_for_service(0.3), 0.3, 30)

started = threading.Event()


def later():
    started.wait()
    time.sleep(0.5)
    services.append(rospy.Service("late", Trigger, lambda request: {}))


services = []
thread = threading.Thread(target=later)
thread.start()
timed("late", lambda: started.set() or rospy.wait_for_service("late", 60), 0.4, 30)
thread.join()
rosgraph.Master("/other").registerService("/dead", "rosrpc://localhost:1", "http://localhost:1/")
timed("registered, not running", lambda: rospy.wait_for_service("dead", 0.5), 0.5, 30)
timed("private", lambda: rospy.wait_for_service("~p", 0.1), 0.1, 30)
private = rospy.Service("~p", Trigger, lambda request: {})
timed("private", lambda: rospy.wait_for_service("~p", 60), 0, 30)
service.shutdown()
timed("shut down", lambda: rospy.wait_for_service("there", 0.3), 0.3, 30)
threading.Timer(0.3, rospy.signal_shutdown, ["because"]).start()
timed("node shut down meanwhile", lambda: rospy.wait_for_service("absent"), 0, 30)
timed("node shut down", lambda: rospy.wait_for_service("absent"), 0, 30)
timed("node shut down, timeout", lambda: rospy.wait_for_service("absent", 60), 0, 30)
