"""rosservice in programs that call services by name; the program is not a node yet."""

import contextlib
import io
import os

import rosgraph
import rosservice
from referee import Other, outcome, show
from roscpp.srv import SetLoggerLevel

other = Other(
    """
import rospy
from roscpp.srv import SetLoggerLevel, SetLoggerLevelResponse
from std_srvs.srv import Empty, EmptyResponse, SetBool, SetBoolResponse, Trigger

def fail(request):
    raise ValueError("not today")

rospy.init_node("other")
rospy.Service("/level", SetLoggerLevel, lambda request: SetLoggerLevelResponse())
rospy.Service("~switch", SetBool, lambda request: SetBoolResponse(request.data, "done"))
rospy.Service("/empty", Empty, lambda request: EmptyResponse())
rospy.Service("/fails", Trigger, fail)
print("ready", flush=True)
rospy.spin()
"""
)
other.read()
dead = rosgraph.Master("/dead")
dead.registerService("/dead_service", "rosrpc://localhost:1", "http://localhost:1")


def names(*args, **kwargs):
    return [each for each in sorted(rosservice.get_service_list(*args, **kwargs)) if "log" not in str(each)]


def called(*args):
    request, response = rosservice.call_service(*args)
    return type(request).__name__, str(request), type(response).__name__, str(response)


def kind(label, call):
    """Print a call's result, or the type of its exception."""
    try:
        show(label, "gives", call())
    except Exception as error:  # noqa: BLE001 - whatever it is
        show(label, "raises", type(error).__name__)


show("# list")
outcome("all", names)
outcome("of a node", lambda: names("/other"))
outcome("of nobody", lambda: names("/nobody"))
outcome("below", lambda: names(namespace="/other"))
outcome("below", lambda: names(namespace="/other/"))
outcome("below", lambda: names(namespace="/o"))
outcome("with nodes", lambda: [(name, list(nodes)) for name, nodes in names(include_nodes=True)])
outcome("find", lambda: rosservice.rosservice_find("std_srvs/SetBool"))
show("# one that is gone")
kind("type", lambda: rosservice.get_service_type("/dead_service"))
kind("class", lambda: rosservice.get_service_class_by_name("/dead_service"))
kind("uri", lambda: rosservice.get_service_uri("/dead_service"))
kind("node", lambda: rosservice.get_service_node("/dead_service"))
kind("args", lambda: rosservice.get_service_args("/dead_service"))
kind("headers", lambda: rosservice.get_service_headers("/dead_service", "rosrpc://localhost:1"))
show("# call")
outcome("dictionary", lambda: called("/level", [{"logger": "rosout", "level": "info"}]))
outcome("values", lambda: called("/level", ["rosout", "info"]))
outcome("class", lambda: called("/level", ["rosout", "info"], SetLoggerLevel))
outcome("empty", lambda: called("/empty", []))
outcome("empty", lambda: called("/empty", [{}]))
outcome("bool", lambda: called("/other/switch", [True]))
kind("too few", lambda: called("/level", ["rosout"]))
kind("too many", lambda: called("/level", ["rosout", "info", "more"]))
kind("wrong field", lambda: called("/level", [{"logger": "rosout", "none": "info"}]))
kind("wrong type", lambda: called("/level", ["rosout", 5]))
kind("fails", lambda: called("/fails", []))
kind("gone", lambda: called("/dead_service", []))
kind("none", lambda: called("/none", []))
out = io.StringIO()
with contextlib.redirect_stdout(out):
    kind("command", lambda: rosservice.rosservicemain(["rosservice", "type", "/empty"]))
show(repr(out.getvalue()))
with contextlib.redirect_stderr(io.StringIO()):
    try:
        rosservice.rosservicemain(["rosservice", "type", "/none"])
    except SystemExit as error:
        show("SystemExit", error.code)
other.close(3.0)
show("# without a master")
os.environ["ROS_MASTER_URI"] = "http://localhost:1"
kind("type", lambda: rosservice.get_service_type("/x"))
kind("class", lambda: rosservice.get_service_class_by_name("/x"))
kind("node", lambda: rosservice.get_service_node("/x"))
kind("find", lambda: rosservice.rosservice_find("std_srvs/Empty"))
