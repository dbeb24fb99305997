"""The index of packages by which PyPI's xacro resolves `$(find PACKAGE)`: a look-up in the packages that we find.

xacro is made for both ROS 1 and 2, and its release on PyPI looks packages up as ROS 2 does. With a real ROS 2 in the
environment its own module comes first.
"""
