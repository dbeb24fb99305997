"""rospy_message_converter: messages as dicts and JSON, and back. Source: http://wiki.ros.org/rospy_message_converter."""
