"""Topics before init_node: calls that wait for it, and calls that fail."""

import rospy
from referee import eventually, outcome, show
from std_msgs.msg import Bool, String

publisher = rospy.Publisher("early", String, queue_size=1, latch=True)
got = []
subscriber = rospy.Subscriber("early", String, lambda message: got.append(message.data))
show(publisher.name, publisher.resolved_name, subscriber.name)
outcome("publish before init_node", lambda: publisher.publish("x"))
outcome("a bad value before init_node", lambda: publisher.publish(1, 2))
outcome("connections", publisher.get_num_connections)
outcome("a private name", lambda: rospy.Publisher("~early", Bool, queue_size=1).name)
outcome("a private name of a subscriber", lambda: rospy.Subscriber("~early", Bool).name)
gone = rospy.Publisher("gone", Bool, queue_size=1)
gone.unregister()
outcome("publish after unregister", lambda: gone.publish(True))
outcome("wait_for_message", lambda: rospy.wait_for_message("early", String, 0.2).data)

rospy.init_node("case", argv=["early:=later"])
show("after init_node", publisher.name, rospy.resolve_name("early"))
show("connected", eventually(lambda: publisher.get_num_connections() == 1))
publisher.publish("after")
show("received", eventually(lambda: got == ["after"]), got)
show(sorted(pair for pair in rospy.get_published_topics() if pair[0] != "/rosout_agg"))
