"""tf2_ros.buffer, provided by minirospy: the buffer with waiting lookups. Source: http://wiki.ros.org/tf2_ros."""

from tf2_msgs.srv import FrameGraph as FrameGraph
from tf2_msgs.srv import FrameGraphResponse as FrameGraphResponse

from minirospy.ros.tf2_ros.tf2_ros.buffer import (
    DEFAULT_CAN_TRANSFORM_POLLING_SCALE as DEFAULT_CAN_TRANSFORM_POLLING_SCALE,
)
from minirospy.ros.tf2_ros.tf2_ros.buffer import Buffer as Buffer
