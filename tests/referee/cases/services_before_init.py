"""Services and proxies that are created before init_node; a service that a program spins."""

import threading

import rosgraph
import rospy
from referee import outcome, show
from std_srvs.srv import Trigger, TriggerResponse

proxy = rospy.ServiceProxy("early", Trigger)
persistent = rospy.ServiceProxy("early", Trigger, persistent=True)
private = rospy.ServiceProxy("~early", Trigger)
show(proxy.resolved_name, private.resolved_name)
outcome("call", proxy)
outcome("persistent call", persistent)
services = []
outcome(
    "service",
    lambda: services.append(rospy.Service("early", Trigger, lambda request: TriggerResponse(True, "early"))),
)
outcome("private service", lambda: rospy.Service("~early", Trigger, lambda request: {}).resolved_name)
outcome("the same name again", lambda: rospy.Service("early", Trigger, lambda request: {}).resolved_name)
rospy.init_node("case", argv=[])
master = rosgraph.Master("/case")
show(sorted(name for name, _ in master.getSystemState()[2] if "early" in name))
outcome("call", proxy)
outcome("persistent call", persistent)
show(private.resolved_name)

spinning = rospy.Service("spins", Trigger, lambda request: {})
spun = []
thread = threading.Thread(target=lambda: spun.append(spinning.spin()))
thread.start()
show("spins", thread.is_alive(), spun)
spinning.shutdown("enough")
thread.join(60)
show("spun", thread.is_alive(), spun, rospy.is_shutdown())
another = rospy.Service("spins", Trigger, lambda request: {})
thread = threading.Thread(target=lambda: spun.append(another.spin()))
thread.start()
rospy.signal_shutdown("the node ends")
thread.join(60)
show("spun", thread.is_alive(), spun, rospy.is_shutdown())
outcome("call after the shutdown", proxy)
outcome(
    "service after the shutdown", lambda: rospy.Service("late", Trigger, lambda request: {}).resolved_name
)
outcome("shutdown after the shutdown", another.shutdown)
outcome("wait after the shutdown", lambda: rospy.wait_for_service("late", 0.1))
