"""Publishes joysticks as messages. Source: http://wiki.ros.org/joy."""

from minirospy.base.ros1_imports import prefer_ros1

# These modules import ROS 1 messages. In a sourced ROS 2, its packages of the same names would be found first.
prefer_ros1()
