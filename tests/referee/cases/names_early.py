"""Names of topics that a program creates before init_node, with remappings on its command line."""

import sys

sys.argv += ["early:=elsewhere", "__ns:=space", "/abs:=~mine", "late:=later"]

import rospy
from referee import outcome, show
from std_msgs.msg import Bool
from std_srvs.srv import Empty

publisher = rospy.Publisher("early", Bool, queue_size=1)
subscriber = rospy.Subscriber("early", Bool)
show(publisher.name, publisher.resolved_name, subscriber.name)
outcome("private publisher", lambda: rospy.Publisher("~p", Bool, queue_size=1))
outcome("private subscriber", lambda: rospy.Subscriber("~p", Bool))
outcome("private wait_for_message", lambda: rospy.wait_for_message("~p", Bool, timeout=0.1))
outcome("private proxy", lambda: rospy.ServiceProxy("~p", Empty).resolved_name)
outcome("resolve", lambda: rospy.resolve_name("early"))
outcome("remap", lambda: rospy.remap_name("early"))
outcome("remap other", lambda: rospy.remap_name("/abs"))
outcome("param", lambda: rospy.get_param("~p", "unset"))
outcome("publish", lambda: publisher.publish(True))
rospy.init_node("node", anonymous=True)
show(rospy.get_name())
outcome("resolve", lambda: rospy.resolve_name("late"))
show(rospy.Publisher("~p", Bool, queue_size=1).name, rospy.Publisher("/abs", Bool, queue_size=1).name[:11])
show(sorted(topic for topic, _ in rospy.get_published_topics("/space") if "_" not in topic))
