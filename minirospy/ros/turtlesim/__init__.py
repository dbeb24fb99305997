"""Turtlesim in pure Python: the window with the turtles, and the programs for its tutorials.

Source: http://wiki.ros.org/turtlesim.
"""

from minirospy.base.ros1_imports import prefer_ros1

# The modules below import ROS 1 messages. If ROS 2 is sourced, its packages of the same names would be found first.
prefer_ros1()
