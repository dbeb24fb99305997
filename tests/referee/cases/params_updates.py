"""A node's answers to paramUpdate: for a parameter to which it subscribed, and for others."""

import xmlrpc.client

import rosgraph
import rospy
from referee import show

rospy.init_node("node")
rospy.set_param("/cached", {"a": 1})
rospy.get_param_cached("/cached")
node = xmlrpc.client.ServerProxy(rosgraph.Master("/caller").lookupNode("/node"))
for key in ("/cached/", "/cached/a/", "/cached", "/nope", "/cache", "relative", "", 3):
    show(repr(key), *node.paramUpdate("/caller", key, {"a": 2} if key == "/cached/" else 5))
show(*node.paramUpdate("/caller", "/cached"))
