"""The programs of tf, tf2_ros and tf2_tools, based on the buffer and the public node API.

Each has a ``main(words)`` that receives the command-line arguments without remappings, and returns the exit status.
Messages, usage errors and statuses are those of ROS's programs. Source: http://wiki.ros.org/tf/Debugging%20tools,
http://wiki.ros.org/tf2_ros, http://wiki.ros.org/tf2_tools.
"""

from minirospy.base.ros1_imports import prefer_ros1

# The modules in this package import ROS 1 messages.
# Otherwise, if ROS 2 is sourced, Python would first find the ROS 2 message packages with the same names.
prefer_ros1()
