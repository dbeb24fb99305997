"""rospy_message_converter.message_converter, provided by minirospy: messages as dicts."""

from minirospy.ros.rospy_message_converter.rospy_message_converter.message_converter import (
    convert_dictionary_to_ros_message,
    convert_ros_message_to_dictionary,
)

__all__ = ["convert_dictionary_to_ros_message", "convert_ros_message_to_dictionary"]
