"""Nodes that publish a robot's joint states and the frames of its links, using only the public node API.

Source: http://wiki.ros.org/robot_state_publisher, http://wiki.ros.org/joint_state_publisher.
"""

from minirospy.base.ros1_imports import prefer_ros1

# This package's modules import ROS 1 messages.
# If ROS 2 is sourced, Python would otherwise find the ROS 2 packages with the same names.
prefer_ros1()
