"""Names of services: relative, private, global, remapped, in a namespace."""

import rosgraph
import rospy
from referee import outcome, show
from std_srvs.srv import Trigger, TriggerResponse

rospy.init_node("case", argv=["case.py", "old:=new", "~mine:=/theirs", "sub/one:=sub/two"])
master = rosgraph.Master(rospy.get_name())
services = []
for name in ("rel", "~priv", "/glob", "old", "/robot/old", "~mine", "sub/one", "sub/three", "~a/b"):
    service = rospy.Service(name, Trigger, lambda request, name=name: TriggerResponse(True, name))
    services.append(service)
    show(name, "->", service.resolved_name, rospy.ServiceProxy(name, Trigger).resolved_name)
    outcome("   call", lambda: rospy.ServiceProxy(name, Trigger)().message)
    outcome("   by its resolved name", lambda: rospy.ServiceProxy(service.resolved_name, Trigger)().message)
show(sorted(name for name, _ in master.getSystemState()[2]))
services[0].shutdown("done")
outcome("shut down", lambda: rospy.ServiceProxy("rel", Trigger)())
show(sorted(name for name, _ in master.getSystemState()[2]))
outcome(
    "offered again",
    lambda: rospy.Service("rel", Trigger, lambda request: TriggerResponse(True, "again")).resolved_name,
)
outcome("call", lambda: rospy.ServiceProxy("rel", Trigger)().message)
outcome("spin of one that is shut down", lambda: services[0].spin())
