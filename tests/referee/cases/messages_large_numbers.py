"""Numbers that exceed their type: what serialize(), publish(), a call of a service and a bag raise."""

import io
import os

import genpy
import rosbag
import rospy
from geometry_msgs.msg import Point32
from nav_msgs.srv import GetPlan, GetPlanRequest, GetPlanResponse
from referee import eventually, outcome, show
from rospy.msg import serialize_message
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Float32, Float32MultiArray, Int8, UInt64

MESSAGES = {
    "float32": Float32(1e39),
    "negative": Float32(-1e300),
    "limit": Float32(3.4028235e38),
    "beyond": Float32(3.4028236e38),
    "infinite": Float32(float("inf")),
    "list": Float32MultiArray(data=[1.0, 1e39]),
    "point": Point32(1e39, 0, 0),
    "scan": LaserScan(range_max=1e39),
    "int8": Int8(300),
    "uint64": UInt64(2**64),
}
for label, message in MESSAGES.items():
    outcome(label, lambda m=message: m.serialize(io.BytesIO()))
    outcome(f"{label}, checked", message._check_types)
try:
    Float32(1e39).serialize(io.BytesIO())
except genpy.SerializationError:
    show("a SerializationError")
except OverflowError:
    show("an OverflowError")
outcome("serialize_message", lambda: serialize_message(io.BytesIO(), 0, Float32(1e39)))

rospy.init_node("numbers", log_level=rospy.FATAL)
publisher = rospy.Publisher("number", Float32, queue_size=1)
outcome("to nobody", lambda: publisher.publish(1e39))
subscriber = rospy.Subscriber("number", Float32, lambda message: None)
show(eventually(lambda: publisher.get_num_connections() > 0))
outcome("publish", lambda: publisher.publish(1e39))
outcome("publish message", lambda: publisher.publish(Float32(1e39)))
outcome("publish in range", lambda: publisher.publish(1.5))

service = rospy.Service("plan", GetPlan, lambda request: GetPlanResponse())
proxy = rospy.ServiceProxy("plan", GetPlan)
proxy.wait_for_service()
outcome("call", lambda: proxy(GetPlanRequest(tolerance=1e39)))
outcome("call by name", lambda: proxy(tolerance=1e39))
outcome("call in range", lambda: len(proxy(tolerance=1.5).plan.poses))

with rosbag.Bag(os.path.join(os.environ["ROS_HOME"], "numbers.bag"), "w") as bag:
    outcome("bag", lambda: bag.write("/number", Float32(1e39)))
    outcome("bag in range", lambda: bag.write("/number", Float32(1.5)))
