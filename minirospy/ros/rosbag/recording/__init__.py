"""Records and plays bags: two nodes based on `client/`, and the pure code that makes their decisions.

`options` and `splits` (which topics to record, into which files) and `schedule` (when to publish which message) are pure;
`recorder` and `player` are the nodes, `disk` writes files in a thread, `keys` reads single keys from a terminal.
Source: http://wiki.ros.org/rosbag/Commandline.
"""

from minirospy.base.ros1_imports import prefer_ros1

# This package's modules import ROS 1 messages.
# In a shell with ROS 2 sourced, ``import`` would otherwise find ROS 2's packages of the same names.
prefer_ros1()
