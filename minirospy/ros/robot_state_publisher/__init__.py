"""Nodes for robot descriptions: publishing joint states and the frames of links, based on the public node API.

Source: http://wiki.ros.org/robot_state_publisher, http://wiki.ros.org/joint_state_publisher.
"""

from minirospy.base.ros1_imports import prefer_ros1

# These modules import ROS 1 messages; if ROS 2 is sourced, its packages of the same names come first.
prefer_ros1()
