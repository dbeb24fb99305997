"""Names that are refused, or that cause a warning."""

import warnings

import rospy
from referee import outcome, show
from std_msgs.msg import Bool
from std_srvs.srv import Empty, EmptyResponse


def show_outcome(label, call):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        outcome(label, call)
    for warning in caught:
        if warning.category is UserWarning:
            show("   warned:", warning.category.__name__, "|", warning.message)


def kind(call):
    return lambda: type(call()).__name__


for name in ("", None, "/a", "a/b", "~a", 5):
    show_outcome(f"init_node({name!r})", lambda name=name: rospy.init_node(name, argv=[]))
show_outcome("Publisher('~x') before init_node", kind(lambda: rospy.Publisher("~x", Bool, queue_size=1)))
show_outcome("Publisher('x') before init_node", kind(lambda: rospy.Publisher("x", Bool, queue_size=1)))
show_outcome("Subscriber('~x') before init_node", kind(lambda: rospy.Subscriber("~x", Bool)))
show_outcome("get_param('~x') before init_node", lambda: rospy.get_param("~x", "default"))
show_outcome("set_param('~x') before init_node", lambda: rospy.set_param("~x", 1))
show_outcome("init_node('bad-name')", lambda: rospy.init_node("bad-name", argv=[], anonymous=False))
show(rospy.get_name())
for name in ("bad name", "1x", "x-y", "", None, 5, "a//b", "é", "/", "~", "x/", "_x", "$x"):
    show_outcome(f"Publisher({name!r})", kind(lambda name=name: rospy.Publisher(name, Bool, queue_size=1)))
    show_outcome(f"Subscriber({name!r})", kind(lambda name=name: rospy.Subscriber(name, Bool)))
for name in ("bad service", "x-y", "a//b"):
    show_outcome(
        f"Service({name!r})", kind(lambda name=name: rospy.Service(name, Empty, lambda _: EmptyResponse()))
    )
    show_outcome(f"ServiceProxy({name!r})", kind(lambda name=name: rospy.ServiceProxy(name, Empty)))
for name in ("bad param", "1x", "x-y", "a//b"):
    show_outcome(f"set_param({name!r})", lambda name=name: rospy.set_param(name, 1))
    show_outcome(f"get_param({name!r})", lambda name=name: rospy.get_param(name))
    show_outcome(f"has_param({name!r})", lambda name=name: rospy.has_param(name))
show_outcome("get_param('')", lambda: rospy.get_param("", "default") and "something")
