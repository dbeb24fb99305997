"""Arguments that Service and ServiceProxy refuse before anything is sent."""

import rospy
import std_srvs.srv
from referee import outcome
from std_msgs.msg import Bool
from std_srvs.srv import SetBool, SetBoolRequest, Trigger

outcome("proxy before init_node", lambda: rospy.ServiceProxy("early", Trigger).resolved_name)
outcome("call before init_node", lambda: rospy.ServiceProxy("early", Trigger)())
outcome("wait_for_service before init_node", lambda: rospy.wait_for_service("early", timeout=0.1))
rospy.init_node("case", argv=[])

BRIEF, PATIENT = 0.01, 60.0  # seconds to wait for a service that never responds, and for one that does
for label, name, seconds in (
    ("empty", "", BRIEF),
    ("None", None, BRIEF),
    ("space", "a b", BRIEF),
    ("dash", "a-b", PATIENT),
    ("digit", "1a", PATIENT),
    ("two slashes", "a//b", PATIENT),
    ("slash at the end", "a/", PATIENT),
    ("only slash", "/", BRIEF),
    ("tilde inside", "a~b", PATIENT),
    ("unicode", "ż", PATIENT),
):
    outcome("proxy name " + label, lambda: rospy.ServiceProxy(name, Trigger).resolved_name)
    outcome("service name " + label, lambda: rospy.Service(name, Trigger, lambda request: {}).resolved_name)
    outcome("wait name " + label, lambda: rospy.wait_for_service(name, timeout=seconds))
for label, class_ in (
    ("a message", Bool),
    ("a request", SetBoolRequest),
    ("None", None),
    ("a string", "std_srvs/SetBool"),
    ("a module", std_srvs.srv),
    ("an instance", SetBool()),
    ("int", int),
):
    outcome("proxy of " + label, lambda: rospy.ServiceProxy("x", class_).resolved_name)
    outcome("service of " + label, lambda: rospy.Service("x", class_, lambda request: {}).resolved_name)
outcome("handler None", lambda: rospy.Service("h1", Trigger, None).resolved_name)
outcome("call it", lambda: rospy.ServiceProxy("h1", Trigger)())
outcome("handler of no argument", lambda: rospy.Service("h2", Trigger, lambda: None).resolved_name)
outcome("call it", lambda: rospy.ServiceProxy("h2", Trigger)())
outcome(
    "buff_size 0",
    lambda: rospy.Service("b0", Trigger, lambda request: [True, "b"], buff_size=0).resolved_name,
)
outcome(
    "buff_size 1",
    lambda: rospy.Service("b1", Trigger, lambda request: [True, "b" * 20], buff_size=1).resolved_name,
)
outcome("call it", lambda: rospy.ServiceProxy("b1", Trigger)())
for headers in (None, {}, {"a": "b"}):
    outcome(f"headers {headers!r}", lambda: rospy.ServiceProxy("b1", Trigger, headers=headers)())
for timeout in (0, 0.0, -1, "1", rospy.Duration(0), rospy.Duration(-1)):
    outcome(f"timeout {timeout}", lambda: rospy.wait_for_service("b1", timeout))
    outcome(
        f"proxy timeout {timeout}",
        lambda: rospy.ServiceProxy("b1", Trigger).wait_for_service(timeout),
    )
    outcome(f"absent, timeout {timeout}", lambda: rospy.wait_for_service("absent", timeout))
outcome("twice", lambda: rospy.Service("b1", Trigger, lambda request: [True, "second"]).resolved_name)
outcome("first still answers", lambda: rospy.ServiceProxy("b1", Trigger)())
outcome(
    "twice of another type",
    lambda: rospy.Service("b1", SetBool, lambda request: [True, "second"]).resolved_name,
)
outcome("unfit request, server of another type", lambda: rospy.ServiceProxy("h2", SetBool)("no bool"))
outcome("unfit request, no server", lambda: rospy.ServiceProxy("absent", SetBool)("no bool"))
rospy.Service("fit", SetBool, lambda request: [True, "fit"])
outcome("unfit request, its server", lambda: rospy.ServiceProxy("fit", SetBool)("no bool"))
