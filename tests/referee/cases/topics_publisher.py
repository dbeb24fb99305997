"""Publisher: its arguments and their errors, its attributes, all forms of publish(), unregister."""

import inspect
import warnings

import rospy
from referee import outcome, show
from std_msgs.msg import Bool, ColorRGBA, Empty, Header, Int32, String

warnings.simplefilter("always")


def warned(label, call):
    """Print a call's outcome and its warnings."""
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        outcome(label, call)
    for each in seen:
        show(label, "warns", each.category.__name__, "|", str(each.message))


def made(*args, **kwds):
    """Return a Publisher's attributes that can be printed."""
    publisher = rospy.Publisher(*args, **kwds)
    shown = (publisher.name, publisher.resolved_name, publisher.type, publisher.md5sum, publisher.reg_type)
    publisher.unregister()
    return shown


for each in (
    rospy.Publisher.__init__,
    rospy.Publisher.publish,
    rospy.Publisher.get_num_connections,
    rospy.Publisher.unregister,
    rospy.Subscriber.__init__,
    rospy.Subscriber.get_num_connections,
    rospy.Subscriber.unregister,
    rospy.SubscribeListener.peer_subscribe,
    rospy.SubscribeListener.peer_unsubscribe,
    rospy.wait_for_message,
    rospy.get_published_topics,
    rospy.topics.Topic.__init__,
):
    names = [
        name if parameter.default is parameter.empty else f"{name}={parameter.default!r}"
        for name, parameter in inspect.signature(each).parameters.items()
    ]
    show(each.__qualname__, names)
show(rospy.Publisher.__mro__[1].__name__, rospy.Subscriber.__mro__[1].__name__)

rospy.init_node("case", argv=[])
for label, args in {
    "no name": ("", Bool),
    "None as name": (None, Bool),
    "a number as name": (5, Bool),
    "bytes as name": (b"t", Bool),
    "no class": ("/t", None),
    "a string as class": ("/t", "std_msgs/Bool"),
    "a class of no message": ("/t", int),
    "a message as class": ("/t", Bool()),
    "a name with a space": ("/a b", Bool),
    "a private name": ("~t", Bool),
    "a relative name": ("t", Bool),
    "a name with a slash at its end": ("t/", Bool),
    "a name with a hyphen": ("a-b", Bool),
    "a name that begins with a digit": ("5t", Bool),
}.items():
    warned(label, lambda args=args: made(*args, queue_size=1))
warned("no queue_size", lambda: made("/t", Bool))
warned("queue_size 0", lambda: made("/t", Bool, queue_size=0))
warned("queue_size -1", lambda: made("/t", Bool, queue_size=-1))
warned("queue_size a string", lambda: made("/t", Bool, queue_size="5"))
warned("queue_size 1.5", lambda: made("/t", Bool, queue_size=1.5))
warned("headers of no mapping", lambda: made("/t", Bool, queue_size=1, headers=["a"]))
warned("headers of numbers", lambda: made("/t", Bool, queue_size=1, headers={"a": 5}))

publisher = rospy.Publisher("/values", Int32, queue_size=1)
show("type(impl)", publisher.impl is not None, publisher.impl.get_num_connections())
outcome("a message", lambda: publisher.publish(Int32(5)))
outcome("a value", lambda: publisher.publish(5))
outcome("a keyword", lambda: publisher.publish(data=5))
outcome("nothing", publisher.publish)
outcome("another message", lambda: publisher.publish(String("x")))
outcome("None", lambda: publisher.publish(None))
outcome("too many", lambda: publisher.publish(1, 2))
outcome("a wrong keyword", lambda: publisher.publish(value=5))
outcome("both", lambda: publisher.publish(5, data=5))
outcome("a dict", lambda: publisher.publish({"data": 5}))
outcome("a list", lambda: publisher.publish([5]))
outcome("a string for a number", lambda: publisher.publish("5"))
outcome("a class", lambda: publisher.publish(Int32))

colour = rospy.Publisher("/colour", ColorRGBA, queue_size=1)
outcome("four values", lambda: colour.publish(1, 2, 3, 4))
outcome("three of four", lambda: colour.publish(1, 2, 3))
outcome("one of four", lambda: colour.publish(1))
outcome("keywords", lambda: colour.publish(r=1, a=1))
outcome("a wrong one of them", lambda: colour.publish(r=1, x=1))

empty = rospy.Publisher("/empty", Empty, queue_size=1)
outcome("nothing for Empty", empty.publish)
outcome("a value for Empty", lambda: empty.publish(1))

headed = rospy.Publisher("/header", Header, queue_size=1)
outcome("Header", lambda: headed.publish(Header()))
outcome("Header's values", lambda: headed.publish(1, rospy.Time(1), "map"))

show("connections", publisher.get_num_connections())
outcome("unregister", publisher.unregister)
show(publisher.impl, publisher.resolved_name, publisher.type, publisher.md5sum, publisher.data_class)
show(publisher.name, publisher.reg_type)
outcome("unregister again", publisher.unregister)
outcome("publish after unregister", lambda: publisher.publish(5))
outcome("a bad value after unregister", lambda: publisher.publish(value=5))

one, other = rospy.Publisher("/twice", Bool, queue_size=1), rospy.Publisher("/twice", Bool, queue_size=5)
show("one impl", one.impl is other.impl)
one.unregister()
outcome("the other goes on", lambda: other.publish(True))
outcome("another type of the topic", lambda: rospy.Publisher("/twice", String, queue_size=1).type)
other.unregister()

rospy.signal_shutdown("the end")
outcome("publish after shutdown", lambda: colour.publish(1, 2, 3, 4))
outcome("a bad value after shutdown", lambda: colour.publish(1, 2))
outcome("unregister after shutdown", colour.unregister)
outcome("a Publisher after shutdown", lambda: rospy.Publisher("/late", Bool, queue_size=1).publish(True))
