"""Turtlesim in pure Python: the window with the turtles, and the programs for its tutorials.

Source: http://wiki.ros.org/turtlesim.
"""

from minirospy.base.ros1_imports import prefer_ros1

# The modules in this package import ROS 1 messages.
# Otherwise, if ROS 2 is sourced, Python would first find the ROS 2 message packages with the same names.
prefer_ros1()
