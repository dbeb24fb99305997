"""Robots as nodes: their joints' states and the frames of their links, on the public node API.

Source: http://wiki.ros.org/robot_state_publisher, http://wiki.ros.org/joint_state_publisher.
"""

from minirospy.base.ros1_imports import prefer_ros1

# Its modules import messages of ROS 1, which are not the first of their names where ROS 2 is sourced.
prefer_ros1()
