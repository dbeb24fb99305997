"""rospy.get_master(): the Master API's answers, and parameters like a dictionary."""

import os
import xmlrpc.client

import rospy
from referee import outcome, show

outcome("before init_node", lambda: rospy.get_master().getPid()[0])
rospy.init_node("n", argv=["x:=y"])
master = rospy.get_master()
show(type(master).__name__, isinstance(master, rospy.MasterProxy), rospy.get_master() is master)
show(len(master.getPid()), type(master.getPid()[2]).__name__)
for method, *args in (
    ("getUri",), ("getParam", "nope"), ("getParam", "/nope"), ("lookupNode", "/nope"), ("lookupNode", "n"),
    ("hasParam", "x"), ("setParam", "~z", 1), ("setParam", "d", {"a": [1, 2.5, True, "x"]}), ("getParam", "/d"),
    ("searchParam", "z"), ("searchParam", "d"), ("deleteParam", "~z"), ("deleteParam", "~z"), ("lookupService", "nope"),
    ("lookupService", "~get_loggers"), ("subscribeParam", "/x", "y"), ("setParam", "/x", 5), ("setParam", "x", 6),
    ("getParam", "y"),
):  # fmt: skip
    outcome(f"{method}{args}", lambda: getattr(master, method)(*args))
outcome("published", lambda: [row for row in master.getPublishedTopics("/")[2] if "agg" not in row[0]])
outcome("types", lambda: ["/rosout", "rosgraph_msgs/Log"] in master.getTopicTypes()[2])
outcome("state", lambda: [len(part) for part in master.getSystemState()[2]][2] >= 2)
try:
    master.foo()
except xmlrpc.client.Fault as error:
    show(error.faultCode)
outcome("in", lambda: "x2" in master)
outcome("[]", lambda: master["nope"])
outcome("[]=", lambda: master.__setitem__("q", 5))
outcome("[]", lambda: master["q"])
outcome("in", lambda: "q" in master)
outcome("del", lambda: master.__delitem__("q"))
outcome("del", lambda: master.__delitem__("q"))
outcome("names", lambda: sorted(name for name in master if name in ("/d/a", "/y", "/x")))
outcome("search", lambda: master.search_param("d"))
outcome("search", lambda: master.search_param("nope"))
outcome("cached", lambda: master.get_param_cached("/d"))
outcome("target", lambda: master.target.getParam(rospy.get_name(), "/d"))
outcome("nobody there", lambda: rospy.MasterProxy("http://localhost:1").getPid())
outcome("another", lambda: rospy.get_master(env={**os.environ}) is master)
outcome("by its uri", lambda: rospy.MasterProxy(os.environ["ROS_MASTER_URI"]).getParam("/d"))
