"""Recording topics into bags and playing bags: two nodes based on `client/`, and their decisions as pure code.

`options` and `splits` (which topics to record, into which files) and `schedule` (when to publish which message) are pure;
`recorder` and `player` are the nodes, `disk` writes files in a thread, `keys` reads single keys from a terminal.
Source: http://wiki.ros.org/rosbag/Commandline.
"""

from minirospy.base.ros1_imports import prefer_ros1

# These modules import ROS 1 messages; if ROS 2 is sourced, its packages of the same names come first.
prefer_ros1()
