"""rosnode, rostopic, rosservice called from Python code, with a node in the same program."""

import os

import rosgraph
import rosnode
import rospy
import rosservice
import rostopic
from referee import Other, eventually, outcome, show
from std_msgs.msg import Bool, Header, String
from std_srvs.srv import SetBool, SetBoolResponse

other = Other(
    "import rospy; rospy.init_node('other', disable_signals=False); print('ready', flush=True); rospy.spin()"
)
other.read()
rospy.init_node("tester")
bools = rospy.Publisher("/ns/bools", Bool, queue_size=1)
headers = rospy.Publisher("headers", Header, queue_size=1)
listener = rospy.Subscriber("/heard", String, lambda message: None)
anything = rospy.Subscriber("/any", rospy.AnyMsg, lambda message: None)
service = rospy.Service("~switch", SetBool, lambda request: SetBoolResponse(request.data, "done"))

show("# rosnode")
outcome("names", lambda: sorted(rosnode.get_node_names()))
outcome("names below", lambda: rosnode.get_node_names("/nothing"))
outcome("ping", lambda: rosnode.rosnode_ping("tester", max_count=1))
outcome("ping nobody", lambda: rosnode.rosnode_ping("/nobody", max_count=1))
outcome("ping nobody aloud", lambda: rosnode.rosnode_ping("/nobody", max_count=1, verbose=True))
outcome("ping all", lambda: [sorted(each) for each in rosnode.rosnode_ping_all()])
outcome("uri", lambda: rosnode.get_api_uri(rosgraph.Master("/x"), "/nobody"))
outcome("uri", lambda: rosnode.get_api_uri(rosgraph.Master("/x"), "/tester") == rospy.get_node_uri())
outcome("machines", rosnode.get_machines_by_nodes)
outcome("nodes by machine", lambda: sorted(rosnode.get_nodes_by_machine("localhost")))
outcome("nodes by unknown machine", lambda: rosnode.get_nodes_by_machine("no.such.machine.invalid"))
show(rosnode.ID, rosnode.NAME, [c.__name__ for c in rosnode.ROSNodeIOException.__mro__][:3])
outcome("kill", lambda: rosnode.kill_nodes(["/nobody", "other"]))
show(other.close())
outcome("gone", lambda: eventually(lambda: "/other" not in rosnode.get_node_names()))

show("# rostopic")


def without_function(found):
    return found[0], found[1], found[2] is None


for name in ("/ns/bools", "/ns/bools/data", "/headers/stamp/secs", "/heard", "/any", "/none"):
    outcome(f"type {name}", lambda n=name: without_function(rostopic.get_topic_type(n)))
    outcome(f"class {name}", lambda n=name: without_function(rostopic.get_topic_class(n)))
cls, topic, function = rostopic.get_topic_class("/headers/stamp/secs")
header = Header(frame_id="f")
header.stamp.secs = 7
outcome("field", lambda: function(header))
outcome("find", lambda: rostopic.find_by_type("std_msgs/Bool"))
outcome("find none", lambda: rostopic.find_by_type("no/Type"))
published, subscribed = rostopic.get_topic_list()
show(sorted(each for each in published if "rosout" not in each[0]))
show(sorted(each for each in subscribed if "rosout" not in each[0]))
for path in ("", "/", "/data", "data", "/a/b", "/a[0]/b", "/a[1:2]", "/a[]", "/a[x]"):
    outcome(f"msgevalgen {path!r} is None", lambda p=path: rostopic.msgevalgen(p) is None)
show([c.__name__ for c in rostopic.ROSTopicIOException.__mro__][:3])

hz = rostopic.ROSTopicHz(-1)
outcome("hz of nothing", lambda: hz.get_hz())
outcome("hz of nothing", lambda: hz.get_hz("/t"))
bandwidth = rostopic.ROSTopicBandwidth(100)
delay = rostopic.ROSTopicDelay(100)
outcome("delay of nothing", lambda: delay.get_delay())
outcome("print of nothing", lambda: hz.print_hz(["/t"]))
outcome("print of nothing", lambda: bandwidth.print_bw())
outcome("print of nothing", lambda: delay.print_delay())

show("# rosservice")
for name in ("/tester/switch", "/none"):
    outcome(f"type {name}", lambda n=name: rosservice.get_service_type(n))
    outcome(f"node {name}", lambda n=name: rosservice.get_service_node(n))
    outcome(f"uri {name}", lambda n=name: rosservice.get_service_uri(n))
    outcome(f"class {name}", lambda n=name: rosservice.get_service_class_by_name(n).__name__)
outcome("args", lambda: rosservice.get_service_args("/tester/switch"))
outcome("args none", lambda: rosservice.get_service_args("/none"))
outcome("list", lambda: [each for each in sorted(rosservice.get_service_list()) if "log" not in each])
outcome(
    "list node",
    lambda: [each for each in sorted(rosservice.get_service_list(node="/tester")) if "log" not in each],
)
outcome("list below", lambda: rosservice.get_service_list(namespace="/nothing"))
outcome("list with nodes", lambda: sorted(rosservice.get_service_list(include_nodes=True))[-1])
outcome("find", lambda: rosservice.rosservice_find("std_srvs/SetBool"))
headers = rosservice.get_service_headers("/tester/switch", rosservice.get_service_uri("/tester/switch"))
show("headers", [headers[name] for name in ("callerid", "md5sum", "type")])
outcome("has args", lambda: rosservice.has_service_args("/tester/switch"))
show([c.__name__ for c in rosservice.ROSServiceIOException.__mro__][:3], rosservice.NAME)

show("# without a master")
os.environ["ROS_MASTER_URI"] = "http://localhost:1"
for ask in (rosnode.get_node_names, rosservice.get_service_list):
    try:
        ask()
    except Exception as error:  # noqa: BLE001 - whatever it is
        show(ask.__name__, type(error).__name__)
