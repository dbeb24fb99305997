"""The package index with which PyPI's xacro resolves `$(find PACKAGE)`: it looks up packages as minirospy does.

xacro supports both ROS 1 and 2, and its PyPI release looks packages up as ROS 2 does. In an environment with ROS 2, the
real module takes precedence.
"""
