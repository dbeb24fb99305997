"""Programs that forward topics: relay, throttle, drop, mux. Source: http://wiki.ros.org/topic_tools."""

from minirospy.base.ros1_imports import prefer_ros1

# The modules below import ROS 1 messages; if ROS 2 is sourced, its packages of the same names would be imported
# instead.
prefer_ros1()
