"""Maps: conversion of image files to OccupancyGrid and back. Source: http://wiki.ros.org/map_server."""

from minirospy.base.ros1_imports import prefer_ros1

# These modules import ROS 1 messages; if ROS 2 is sourced, its packages of the same names come first.
prefer_ros1()
