"""tf2_sensor_msgs, provided by minirospy: point clouds for tf2_ros. Source: http://wiki.ros.org/tf2_sensor_msgs."""

from sensor_msgs.msg import PointCloud2 as PointCloud2

from minirospy.ros.tf2_sensor_msgs.tf2_sensor_msgs.tf2_sensor_msgs import (
    do_transform_cloud as do_transform_cloud,
)
from minirospy.ros.tf2_sensor_msgs.tf2_sensor_msgs.tf2_sensor_msgs import from_msg_msg as from_msg_msg
from minirospy.ros.tf2_sensor_msgs.tf2_sensor_msgs.tf2_sensor_msgs import to_msg_msg as to_msg_msg
from minirospy.ros.tf2_sensor_msgs.tf2_sensor_msgs.tf2_sensor_msgs import transform_to_kdl as transform_to_kdl
from tf2_sensor_msgs import tf2_sensor_msgs as tf2_sensor_msgs
