"""Publishes joysticks as messages. Source: http://wiki.ros.org/joy."""

from minirospy.base.ros1_imports import prefer_ros1

# This package's modules import ROS 1 messages.
# If ROS 2 is sourced, Python would otherwise find the ROS 2 packages with the same names.
prefer_ros1()
