"""Programs that forward topics: relay, throttle, drop, mux. Source: http://wiki.ros.org/topic_tools."""

from minirospy.base.ros1_imports import prefer_ros1

# The modules below import messages of ROS 1; if ROS 2 is sourced, its packages of the same names would come first.
prefer_ros1()
