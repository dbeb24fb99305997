"""Checks of names in rosmaster.validators and rospy.core, and the keys for which a parameter tree searches."""

import rospy.core
from referee import outcome, show
from rosmaster.paramserver import ParamDictionary
from rosmaster.validators import is_service, is_topic

show("# names")
for name in ("a", "/a", "~a", "~/a", "~", "", "/", "//", "a b", "a:b", "/~a", "a/", "1a", "a//b", None, 3):
    for caller in ("/node", "/"):
        for kind, check in (("topic", is_topic), ("service", is_service), ("rospy's", rospy.core.is_topic)):
            outcome(f"{kind} {name!r} {caller}", lambda c=check, n=name, k=caller: c("t")(n, k))

show("# search")
tree = ParamDictionary(None)
tree.set_param("/a/b", 1)
tree.set_param("/c", 2)
for namespace in ("/", "/a", "/a/b", "", "a"):
    for key in ("", "/", "b", "a", "a/b", "c", "/c", "/a/b", "~b", "~", "c/", "a/x", "/nope"):
        outcome(f"{namespace!r} {key!r}", lambda n=namespace, k=key: tree.search_param(n, k))
