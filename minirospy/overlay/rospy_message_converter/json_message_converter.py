"""rospy_message_converter.json_message_converter, provided by minirospy: messages as JSON."""

from minirospy.ros.rospy_message_converter.rospy_message_converter.json_message_converter import (
    convert_json_to_ros_message,
    convert_ros_message_to_json,
)

__all__ = ["convert_json_to_ros_message", "convert_ros_message_to_json"]
