"""Parameters: names, namespaces, exceptions."""

import inspect

import rospy
from referee import outcome, show

outcome("private before init_node", lambda: rospy.get_param("~x"))
outcome("set", lambda: rospy.set_param("~x", 1))
outcome("get", lambda: rospy.get_param("~x"))
outcome("get", lambda: rospy.get_param("/unnamed/x"))
outcome("names", lambda: [name for name in rospy.get_param_names() if "unnamed" in name])
outcome("delete", lambda: rospy.delete_param("~x"))
rospy.delete_param("/unnamed")

rospy.init_node(
    "case", argv=["v:=w", "_p:=5", "_q:=[1, 2]", "_e:=", "_s:='5'", "_b:=true", "_d:={a: {b: 1}}", "_n/m:=1"]
)
outcome("from the command line", lambda: rospy.get_param("~"))
for name in (
    "p",
    "~p",
    "/case/p",
    "case/p",
    "~n/m",
    "~d/a/b",
    "~nope",
    "/nope",
    "~d/nope",
    "~p/below",
    "/",
    "",
):
    outcome(f"has {name!r}", lambda name=name: rospy.has_param(name))
    outcome(f"get {name!r} or default", lambda name=name: rospy.get_param(name, "default"))
for name in ("nope", "~nope", "/nope/x", "~p/below"):
    outcome(f"get {name!r}", lambda name=name: rospy.get_param(name))
    outcome(f"delete {name!r}", lambda name=name: rospy.delete_param(name))
for default in (None, 0, "", [], {}):
    outcome("default", lambda default=default: rospy.get_param("nope", default))
outcome("by name", lambda: rospy.get_param(param_name="nope", default=1))
outcome("by name", lambda: rospy.set_param(param_name="by_name", param_value=1))
outcome("by name", lambda: rospy.delete_param(param_name="by_name"))

rospy.set_param("w", 1)
outcome("remapped get", lambda: rospy.get_param("v"))
outcome("remapped search", lambda: rospy.search_param("v"))
outcome("remapped delete", lambda: rospy.delete_param("v"))
outcome("remapped search", lambda: rospy.search_param("v"))
rospy.set_param("/case/near", 1)
rospy.set_param("/near", 1)
rospy.set_param("/far/off", 1)
for name in (
    "near",
    "far",
    "far/off",
    "far/nope",
    "nope",
    "/far",
    "/nope",
    "~near",
    "~",
    "",
    "/",
    "case",
    "case/near",
):
    outcome(f"search {name!r}", lambda name=name: rospy.search_param(name))
for name in ("a b", "1a", "a//b", "a:b", "-a", "\u00e4", "a~"):
    outcome(f"set {name!r}", lambda name=name: rospy.set_param(name, name))
    outcome(f"get {name!r}", lambda name=name: rospy.get_param(name))
    outcome(f"search {name!r}", lambda name=name: rospy.search_param(name))
    outcome(f"delete {name!r}", lambda name=name: rospy.delete_param(name))
outcome("a namespace", lambda: rospy.set_param("/x", {"a": 1, "b": {"c": 2}}))
outcome("below", lambda: rospy.get_param("/x/b/c"))
outcome("trailing slash", lambda: rospy.get_param("/x/b/"))
outcome("replaced", lambda: rospy.set_param("/x/b", 5) or rospy.get_param("/x"))
outcome("a value in the way", lambda: rospy.set_param("/x/b/c/d", 1) or rospy.get_param("/x"))
outcome("deleted below", lambda: rospy.delete_param("/x/b/c/d") or rospy.get_param("/x"))
outcome("private namespace", lambda: rospy.set_param("~", {"only": 1}) or rospy.get_param("/case"))
outcome("delete it", lambda: rospy.delete_param("~") or rospy.has_param("~"))
outcome("delete the root", lambda: rospy.delete_param("/"))
outcome("set the root", lambda: rospy.set_param("/", {"a": {"b": 1}, "c": 2}))
outcome("names", lambda: sorted(rospy.get_param_names()))
outcome("all", lambda: rospy.get_param("/"))
for function in ("get_param", "get_param_cached", "set_param", "has_param", "delete_param", "search_param"):
    show(function, list(inspect.signature(getattr(rospy, function)).parameters))
