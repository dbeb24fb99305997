"""rospy_message_converter, provided by minirospy: messages as dicts. Source: http://wiki.ros.org/rospy_message_converter."""
