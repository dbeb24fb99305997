#!/usr/bin/env python3
import rospy
from std_msgs.msg import String
from std_srvs.srv import Empty, EmptyResponse

rospy.init_node("talker")
publisher = rospy.Publisher("chatter", String, queue_size=10)
service = rospy.Service("clear", Empty, lambda request: EmptyResponse())
rospy.Subscriber("orders", String, lambda message: None)
rate = rospy.Rate(50)
while not rospy.is_shutdown():
    publisher.publish("hello")
    try:
        rate.sleep()
    except rospy.ROSInterruptException:
        break
