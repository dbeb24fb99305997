"""Subscriber: arguments and errors, callbacks and their arguments, several on a topic, unregister, subscribe again."""

import logging
import threading

import rospy
from referee import eventually, outcome, show
from std_msgs.msg import Bool, ColorRGBA, Int32


class Lines(logging.Handler):
    """Prints a log line's level and its first line."""

    def emit(self, record):
        lines = record.getMessage().splitlines()
        show("log", record.levelname, lines[0].split(" at 0x")[0], "|", lines[-1] if len(lines) > 1 else "")


rospy.init_node("case", argv=[])
logging.getLogger("rosout").addHandler(Lines())

for label, args in {
    "no name": ("", Bool),
    "a number as name": (5, Bool),
    "no class": ("/t", None),
    "a string as class": ("/t", "std_msgs/Bool"),
    "a class of no message": ("/t", int),
    "a message as class": ("/t", Bool()),
    "a callback that is none": ("/t", Bool, 5),
    "a private name": ("~t", Bool),
}.items():
    outcome(label, lambda args=args: rospy.Subscriber(*args).name)
for value in (-1, 0, 1, "5", 1.5):
    outcome(f"queue_size {value!r}", lambda value=value: rospy.Subscriber("/q", Bool, queue_size=value).name)
for value in (-1, 0, 1, "5", 1 << 24):
    outcome(f"buff_size {value!r}", lambda value=value: rospy.Subscriber("/b", Bool, buff_size=value).name)

publisher = rospy.Publisher("/chatter", Int32, queue_size=10)
seen = {}
arrived = threading.Condition()


def note(key, *values):
    with arrived:
        seen.setdefault(key, []).append(values)
        arrived.notify_all()


def wait(key, count):
    with arrived:
        return arrived.wait_for(lambda: len(seen.get(key, ())) >= count, 60)


plain = rospy.Subscriber("/chatter", Int32, lambda message: note("plain", message.data))
args = rospy.Subscriber("/chatter", Int32, lambda message, extra: note("args", message.data, extra), ("x", 5))
none = rospy.Subscriber("/chatter", Int32)
false = rospy.Subscriber("/chatter", Int32, lambda *values: note("false", len(values)), callback_args=0)
show(none.callback, plain.callback_args, args.callback_args, plain.impl is args.impl, plain.name, plain.type)
# Each endpoint reports the connection by itself.
show(
    "connected",
    eventually(lambda: publisher.get_num_connections() == 1 == plain.get_num_connections()),
    plain.get_num_connections(),
)
for number in range(3):
    publisher.publish(number)
for key in ("plain", "args", "false"):
    wait(key, 3)
    show(key, seen[key])

args.unregister()
show(args.callback, args.callback_args, args.impl, args.type, args.name, args.resolved_name)
outcome("unregister again", args.unregister)
publisher.publish(3)
wait("plain", 4)
show(seen["plain"], len(seen["args"]))

seen.clear()


def same(message):
    note("same", message.data)


twins = [rospy.Subscriber("/chatter", Int32, same) for _ in range(2)]
publisher.publish(4)
wait("same", 2)
show("one function twice", seen["same"])
twins[0].unregister()
publisher.publish(5)
wait("same", 3)
wait("plain", 2)
show("one of them gone", seen["same"], seen["plain"])

seen.clear()


def bad(message):
    note("bad", message.data)
    if message.data == 6:  # minirospy logs the same error once
        raise ValueError("bad thing")


failing = rospy.Subscriber("/chatter", Int32, bad)
after = rospy.Subscriber("/chatter", Int32, lambda message: note("after", message.data))
publisher.publish(6)
publisher.publish(7)
wait("after", 2)
show("after a bad callback", seen["bad"], seen["after"])
failing.unregister()
wrong = rospy.Subscriber("/chatter", Int32, lambda: None)
publisher.publish(8)
wait("after", 3)
wrong.unregister()

for subscriber in (plain, none, false, twins[1]):
    subscriber.unregister()
publisher.publish(9)
wait("after", 4)
show("the last one", seen["after"], publisher.get_num_connections())
after.unregister()
show("nobody", eventually(lambda: publisher.get_num_connections() == 0))
seen.clear()
again = rospy.Subscriber("/chatter", Int32, lambda message: note("again", message.data))
show("again", eventually(lambda: publisher.get_num_connections() == 1))
publisher.publish(10)
wait("again", 1)
show(seen["again"])
outcome("a class of fields", lambda: rospy.Subscriber("/colour", ColorRGBA).type)
rospy.signal_shutdown("the end")
outcome("unregister after shutdown", again.unregister)
outcome("subscribe after shutdown", lambda: rospy.Subscriber("/late", Bool).name)
