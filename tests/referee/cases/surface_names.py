"""rospy.names: the functions other than resolve_name."""

import rospy
import rospy.names as names
from referee import outcome, show

rospy.init_node("n", argv=["a:=b", "__name:=m", "_x:=3", "__unknown:=u"])
show(names.get_mappings(), names.get_resolved_mappings())
show(names.load_mappings(["p", "a:=b", "_p:=1", "x", "~c:=d", "__ns:=n", "bad-name:=y"]))
for function in ("canonicalize_name", "isstring", "make_global_ns", "namespace"):
    for name in ("", "a", "/a", "~a", "/a/b", "a/b/", "/", "//a//b", "/a/b/c/", "~"):
        outcome(f"{function}({name!r})", lambda: getattr(names, function)(name))
for name in ("", "a", "/a", "~a", "/a/b", "~"):
    show(bool(names.is_global(name)), bool(names.is_private(name)))
outcome("namespace(None)", lambda: names.namespace(None))
for pair in (
    ("/a", "b"),
    ("/a/", "b"),
    ("/a", "/b"),
    ("~", "b"),
    ("/a", "~b"),
    ("", "b"),
    ("a", "b"),
    ("/", "b"),
    ("/a", ""),
):
    outcome(f"ns_join{pair}", lambda: names.ns_join(*pair))
    outcome(f"scoped_name{pair}", lambda: names.scoped_name(*pair))
outcome("scoped_name", lambda: names.scoped_name("/ns/node", "/ns/topic"))
outcome("namespace", lambda: names.get_ros_namespace())
outcome("namespace of", lambda: names.get_ros_namespace(env={}))
outcome("namespace of", lambda: names.get_ros_namespace(env={"ROS_NAMESPACE": "x"}))
outcome("namespace of", lambda: names.get_ros_namespace(env={"ROS_NAMESPACE": "x"}, argv=["__ns:=y/z"]))
for value in ("a", "a b", "/a", "~a", "", "a:b", 5, None):
    outcome(f"valid_name {value!r}", lambda: names.valid_name("x")(value, "/c"))
    outcome(f"valid_name unresolved {value!r}", lambda: names.valid_name("x", False)(value, "/c"))
    outcome(f"global_name {value!r}", lambda: names.global_name("x")(value, "/c"))
    outcome(f"is_topic {value!r}", lambda: rospy.core.is_topic("x")(value, "/c"))
show(names.TOPIC_ANYTYPE, names.ANYTYPE, names.SERVICE_ANYTYPE, names.GLOBALNS, names.SEP, names.REMAP)
outcome("reload", lambda: names.reload_mappings(["c:=d"]))
show(names.get_mappings())
outcome("initialize", lambda: names.initialize_mappings("/n"))
show(names.get_mappings(), names.get_resolved_mappings())
outcome("resolve", lambda: rospy.resolve_name("c"))
outcome("without node name", lambda: names.resolve_name_without_node_name("a"))
outcome("without node name", lambda: names.resolve_name_without_node_name("~a"))
