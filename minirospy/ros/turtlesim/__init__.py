"""Turtlesim: the window of turtles in pure Python, and its tutorials' programs. Source: http://wiki.ros.org/turtlesim."""

from minirospy.base.ros1_imports import prefer_ros1

# Its modules import messages of ROS 1, which are not the first of their names where ROS 2 is sourced.
prefer_ros1()
