"""Nodes that publish a robot's joint states and the frames of its links, using only the public node API.

Source: http://wiki.ros.org/robot_state_publisher, http://wiki.ros.org/joint_state_publisher.
"""

from minirospy.base.ros1_imports import prefer_ros1

# This package's modules import ROS 1 messages.
# In a shell with ROS 2 sourced, ``import`` would otherwise find ROS 2's packages of the same names.
prefer_ros1()
