"""AnyMsg and the type `*`: bytes in, bytes out, as a relay needs."""

import threading

import rospy
from referee import eventually, outcome, show
from std_msgs.msg import Int32, String

rospy.init_node("case", argv=[])
got = []
arrived = threading.Condition()


def take(message):
    with arrived:
        got.append(message)
        arrived.notify_all()


def wait(count):
    with arrived:
        return arrived.wait_for(lambda: len(got) >= count, 60)


show(rospy.AnyMsg._type, rospy.AnyMsg._md5sum, rospy.AnyMsg._has_header, repr(rospy.AnyMsg._full_text))
show(rospy.AnyMsg.__slots__)
outcome("arguments", lambda: rospy.AnyMsg(1))
outcome("empty", lambda: rospy.AnyMsg()._buff)
publisher = rospy.Publisher("/source", String, queue_size=10, latch=True)
publisher.publish("abc")
subscriber = rospy.Subscriber("/source", rospy.AnyMsg, take)
show(subscriber.type, subscriber.md5sum)
wait(1)
show(type(got[0]).__name__, type(got[0]._buff).__name__, got[0]._buff)
show(got[0]._connection_header["type"], got[0]._connection_header["md5sum"])
show(repr(got[0]._connection_header["message_definition"]))
show("deserialised", String().deserialize(got[0]._buff).data)
outcome("waited for", lambda: rospy.wait_for_message("/source", rospy.AnyMsg, 10)._buff)

relay = rospy.Publisher("/relayed", rospy.AnyMsg, queue_size=10)
show(relay.type, relay.md5sum)
heard = []
rospy.Subscriber("/relayed", rospy.AnyMsg, heard.append)
show("connected", eventually(lambda: relay.get_num_connections() == 1))
outcome("relay", lambda: relay.publish(got[0]))
show("relayed", eventually(lambda: len(heard) == 1), heard[0]._buff, heard[0]._connection_header["type"])
outcome("an empty AnyMsg", lambda: relay.publish(rospy.AnyMsg()))
outcome("AnyMsg by values", lambda: relay.publish("x"))
outcome("AnyMsg by nothing", relay.publish)

typed = rospy.Publisher("/typed", String, queue_size=10)
heard_typed = []
rospy.Subscriber("/typed", String, heard_typed.append)
show("connected", eventually(lambda: typed.get_num_connections() == 1))
outcome("AnyMsg on a typed topic", lambda: typed.publish(got[0]))

both = rospy.Publisher("/both", Int32, queue_size=10, latch=True)
both.publish(7)
any_first, typed_second = [], []
rospy.Subscriber("/both", rospy.AnyMsg, any_first.append)
show("any", eventually(lambda: len(any_first) == 1), any_first[0]._buff)
