"""Recording topics into bags and playing bags: two nodes on the node API of `client/`, and what they decide by.

`options` and `splits` (what to record, into which files) and `schedule` (when to publish what) are pure; `recorder` and
`player` are the nodes, `disk` writes files in a thread, `keys` reads single keys of a terminal.
Source: http://wiki.ros.org/rosbag/Commandline.
"""

from minirospy.base.ros1_imports import prefer_ros1

# Its modules import messages of ROS 1, which are not the first of their names where ROS 2 is sourced.
prefer_ros1()
