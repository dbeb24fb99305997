"""rospy_message_converter: converts messages to dicts and JSON, and back.

Source: http://wiki.ros.org/rospy_message_converter.
"""
