"""Calls after the node has shut down."""

import rospy
from referee import outcome, show
from std_msgs.msg import Bool
from std_srvs.srv import Empty

rospy.init_node("case", argv=[])
publisher = rospy.Publisher("t", Bool, queue_size=1)
subscriber = rospy.Subscriber("t", Bool)
service = rospy.Service("s", Empty, lambda _: None)
rospy.set_param("/x", 1)
rospy.signal_shutdown("done")


def kind(call):
    return lambda: type(call()).__name__


show(rospy.is_shutdown(), rospy.core.is_initialized())
outcome("spin", rospy.spin)
outcome("service.spin", service.spin)
outcome("sleep", lambda: rospy.sleep(0.01))
outcome("Rate", lambda: rospy.Rate(100).sleep())
outcome("publish", lambda: publisher.publish(True))
outcome("publish of a wrong type", lambda: publisher.publish(1, 2))
outcome("connections", lambda: (publisher.get_num_connections(), subscriber.get_num_connections()))
outcome("Publisher", kind(lambda: rospy.Publisher("t3", Bool, queue_size=1)))
outcome("Subscriber", kind(lambda: rospy.Subscriber("t3", Bool)))
outcome("Service", kind(lambda: rospy.Service("s3", Empty, lambda _: None)))
outcome("call", lambda: rospy.ServiceProxy("s3", Empty)())
outcome("wait_for_service", lambda: rospy.wait_for_service("s3"))
outcome("wait_for_service", lambda: rospy.wait_for_service("s3", 0.2))
outcome("wait_for_message", lambda: rospy.wait_for_message("t", Bool))
outcome("wait_for_message", lambda: rospy.wait_for_message("t", Bool, 0.2))
outcome("get_param", lambda: rospy.get_param("/x"))
outcome("set_param", lambda: rospy.set_param("/x", 1))
outcome("has_param", lambda: rospy.has_param("/x"))
outcome("get_published_topics", lambda: [row for row in rospy.get_published_topics() if "agg" not in row[0]])
outcome("get_rostime", kind(rospy.get_rostime))
outcome("get_name", rospy.get_name)
outcome("get_node_uri", kind(rospy.get_node_uri))
outcome("init_node", lambda: rospy.init_node("case", argv=[]))
outcome("init_node of another", lambda: rospy.init_node("other", argv=[]))
outcome("service.shutdown", lambda: service.shutdown("x"))
outcome("unregister", publisher.unregister)
outcome("unregister", subscriber.unregister)
outcome("publish", lambda: publisher.publish(True))
timer = rospy.Timer(rospy.Duration(0.01), lambda _: show("timer"))
timer.join(60)
show(timer.is_alive())
