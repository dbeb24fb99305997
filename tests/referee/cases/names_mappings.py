"""The remappings as rospy.names stores them: programs change and replace the dicts, and the node's name."""

import sys

sys.argv[1:] = ["foo:=bar", "__name:=zed", "_private:=5"]
import rospy
import rospy.names as names
from referee import outcome, show
from std_msgs.msg import String

show(names._mappings, names._resolved_mappings, names._caller_id, names._caller_namespace)
show(names.get_mappings() is names._mappings, names.get_resolved_mappings() is names._resolved_mappings)
show(names.resolve_name("foo"), names.remap_name("foo"), names.remap_name("foo", "/x", False))
outcome("initialize", lambda: names.initialize_mappings("/ns/tester"))
show(names._mappings, names._resolved_mappings)
show(names.resolve_name("foo"), names.remap_name("foo"), names.resolve_name("foo", "/ns/tester"))

show("# changed")
names._mappings["added"] = "to"
show(names.get_mappings(), names.resolve_name("added"))
names.initialize_mappings("/ns/tester")
show(names._resolved_mappings, names.resolve_name("added"), names.remap_name("added", "/ns/x"))

show("# replaced")
names._mappings = {"other": "~private", "__name": "zz", "_p": "5"}
show(names.get_mappings(), names.get_resolved_mappings())
names.initialize_mappings("/ns/tester")
show(names.get_resolved_mappings(), names.remap_name("other", "/ns/x"))
names._resolved_mappings["/ns/hand"] = "/by/hand"
show(names.remap_name("hand", "/ns/x"), names.resolve_name("/ns/hand"), names.get_resolved_mappings())
names._resolved_mappings = {"/q": "/r"}
show(names.remap_name("/q"), names.resolve_name("/q"), names.resolve_name("other", "/ns/x"))
names.reload_mappings(["program", "u:=v", "__name:=n2", "_x:=1", "__log:=5"])
show(names._mappings, names._resolved_mappings)

show("# names")
names._set_caller_id("/k/me")
show(names._caller_id, names._caller_namespace, rospy.get_name(), rospy.get_namespace())
names.initialize_mappings("/k/me")
show(names._resolved_mappings, names.resolve_name("u"), names.resolve_name("~u"))
names._caller_id = "/set/by"
show(rospy.get_name(), rospy.get_namespace(), rospy.resolve_name("a"), rospy.resolve_name("~a"))
names._caller_namespace = "/nsx/"
show(rospy.get_name(), rospy.get_namespace(), rospy.resolve_name("a"), rospy.resolve_name("~a"))
for odd in ("", "relative", None, "/"):
    outcome(repr(odd), lambda n=odd: (names._set_caller_id(n), names._caller_id, names._caller_namespace))
    outcome(repr(odd), lambda n=odd: (names.initialize_mappings(n), names._resolved_mappings))

show("# node")
rospy.init_node("node", argv=["program", "init:=other"])
show(names._mappings, names._resolved_mappings, names._caller_id, names._caller_namespace)
names._mappings["late"] = "changed"
names.initialize_mappings(rospy.get_name())
show(rospy.Publisher("late", String, queue_size=1).name, rospy.resolve_name("late"))
names._resolved_mappings["/late2"] = "/changed2"
show(rospy.Subscriber("late2", String).name)
names._resolved_mappings["/parameter"] = "/parameter2"
rospy.set_param("parameter", 3)
del names._resolved_mappings["/parameter"]
show(rospy.get_param("/parameter2"), rospy.has_param("/parameter"))
