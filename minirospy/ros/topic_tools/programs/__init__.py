"""Programs that forward topics: relay, throttle, drop, mux. Source: http://wiki.ros.org/topic_tools."""

from minirospy.base.ros1_imports import prefer_ros1

# The modules in this package import ROS 1 messages.
# Otherwise, if ROS 2 is sourced, Python would first find the ROS 2 message packages with the same names.
prefer_ros1()
