"""Names: resolution and remapping."""

import rospy
from referee import outcome, show

NAMES = (
    "a",
    "/a",
    "~a",
    "/x/y",
    "x/y",
    "~p",
    "q",
    "",
    "/",
    "~",
    "a/",
    "a//b",
    "/a/b/",
    "foo/bar",
    "~/p",
    "b",
    "c",
    "~c",
    "d",
)

show("before init_node", rospy.get_name(), rospy.get_namespace(), rospy.get_caller_id(), rospy.get_node_uri())
outcome("resolve before init_node", lambda: rospy.resolve_name("a"))
outcome("private before init_node", lambda: rospy.resolve_name("~a"))
outcome("remap before init_node", lambda: rospy.remap_name("a"))
argv = [
    "a:=b",
    "/x/y:=z",
    "~p:=q",
    "b:=twice",
    "c:=~priv",
    "~c:=/abs",
    "d:=",
    ":=e",
    " spaced := out ",
    "word",
]
rospy.init_node("case", argv=argv)
show(rospy.get_name(), rospy.get_namespace(), rospy.get_caller_id(), rospy.get_node_uri())
for name in NAMES:
    outcome(f"resolve {name!r}", lambda name=name: rospy.resolve_name(name))
    outcome(f"remap {name!r}", lambda name=name: rospy.remap_name(name))
    outcome(f"remap unresolved {name!r}", lambda name=name: rospy.remap_name(name, resolved=False))
    outcome(f"resolve for another {name!r}", lambda name=name: rospy.resolve_name(name, "/ns/other"))
    outcome(f"remap for another {name!r}", lambda name=name: rospy.remap_name(name, "/ns/other"))
for name in ("spaced", "e", "word"):
    outcome(f"resolve {name!r}", lambda name=name: rospy.resolve_name(name))
outcome("caller_id without slash", lambda: rospy.resolve_name("x", "other"))
outcome("caller_id with slash behind", lambda: rospy.resolve_name("~x", "/other/"))
outcome("None", lambda: rospy.resolve_name(None))
outcome("spaces are kept", lambda: rospy.resolve_name("a b"))
outcome(
    "myargv",
    lambda: rospy.myargv(["prog", "a:=b", "word", "__name:=x", "_p:=1", ":=", "x:=", "--flag=:=", "-v"]),
)
outcome("myargv of nothing", lambda: rospy.myargv([]))
