"""Calls of a proxy: request objects, values, keywords; wrong arguments; the proxy's own attributes."""

import inspect

import rospy
from geometry_msgs.msg import PoseStamped
from nav_msgs.srv import GetPlan, GetPlanRequest
from referee import outcome, show
from std_srvs.srv import (
    Empty,
    EmptyRequest,
    SetBool,
    SetBoolRequest,
    SetBoolResponse,
    TriggerRequest,
)

rospy.init_node("case", argv=[])
seen = []


def set_bool(request):
    seen.append(request)
    return SetBoolResponse(request.data, type(request).__name__)


service = rospy.Service("set_bool", SetBool, set_bool)
proxy = rospy.ServiceProxy("set_bool", SetBool)

outcome("request", lambda: proxy(SetBoolRequest(True)))
outcome("value", lambda: proxy(True))
outcome("keyword", lambda: proxy(data=True))
outcome("nothing", lambda: proxy())
outcome("call()", lambda: proxy.call(True))
outcome("call() with a request", lambda: proxy.call(SetBoolRequest(False)))
outcome("call() with a keyword", lambda: proxy.call(data=True))
outcome("too many", lambda: proxy(True, False))
outcome("unknown keyword", lambda: proxy(date=True))
outcome("value and keyword", lambda: proxy(True, data=True))
outcome("a request of another type", lambda: proxy(TriggerRequest()))
outcome("a response", lambda: proxy(SetBoolResponse(True, "x")))
outcome("str for bool", lambda: proxy("yes"))
outcome("None", lambda: proxy(None))
outcome("list", lambda: proxy([True]))
outcome("dict", lambda: proxy({"data": True}))
outcome("request class", lambda: proxy(SetBoolRequest))
outcome("int", lambda: proxy(1))
outcome("large int", lambda: proxy(300))
show("the header of a request", sorted(seen[0]._connection_header.items()))
header = proxy(True)._connection_header
show("a response has", [(key, header[key]) for key in ("callerid", "md5sum", "service", "type")])

plan_requests = []


def plan(request):
    plan_requests.append(request)
    return {}


plan_service = rospy.Service("plan", GetPlan, plan)
plan_proxy = rospy.ServiceProxy("plan", GetPlan)
outcome("defaults", lambda: plan_proxy().plan.poses)
outcome("a keyword of three", lambda: plan_proxy(tolerance=0.5).plan.poses)
show(plan_requests[-1].tolerance, plan_requests[-1].start.header.frame_id)
outcome("two values of three", lambda: plan_proxy(PoseStamped(), PoseStamped()))
outcome("str for float", lambda: plan_proxy(tolerance="x"))
stamped = GetPlanRequest()
stamped.start.header.frame_id = "map"
outcome("stamped", lambda: plan_proxy(stamped).plan.poses)
show(plan_requests[-1].start.header.frame_id, plan_requests[-1].start.header.seq)

empty = rospy.Service("empty", Empty, lambda request: {})
for label, call in (
    ("Empty()", lambda p: p()),
    ("Empty(request)", lambda p: p(EmptyRequest())),
    ("Empty(1)", lambda p: p(1)),
    ("Empty(a=1)", lambda p: p(a=1)),
    ("Empty(None)", lambda p: p(None)),
):
    outcome(label, lambda: call(rospy.ServiceProxy("empty", Empty)))

show("attributes of a proxy")
for name in ("resolved_name", "persistent", "buff_size", "request_class", "response_class"):
    outcome(name, lambda: getattr(proxy, name, "none"))
outcome("service_class", lambda: proxy.service_class.__name__)
outcome("uri before", lambda: rospy.ServiceProxy("empty", Empty).uri)
outcome("uri", lambda: proxy.uri)
show("attributes of a service")
for name in ("resolved_name", "buff_size", "request_class", "response_class", "uri", "done"):
    outcome(name, lambda: getattr(service, name, "none"))
outcome("service_class", lambda: service.service_class.__name__)
outcome("handler", lambda: service.handler is set_bool)
outcome("error_handler", lambda: callable(service.error_handler))

show("signatures")
for function in (
    rospy.Service,
    rospy.Service.shutdown,
    rospy.Service.spin,
    rospy.ServiceProxy,
    rospy.ServiceProxy.call,
    rospy.ServiceProxy.__call__,
    rospy.ServiceProxy.wait_for_service,
    rospy.ServiceProxy.close,
    rospy.wait_for_service,
):
    outcome(
        function.__name__,
        lambda: [
            (p.name, p.default) if p.default is not p.empty else p.name
            for p in inspect.signature(function).parameters.values()
        ],
    )
