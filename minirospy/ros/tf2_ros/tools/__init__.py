"""The programs of tf, tf2_ros and tf2_tools, on the buffer and the public node API.

Each has a ``main(words)``: the words behind the program's name, remappings taken out, in; an exit status out. Texts,
usage errors and statuses are those of ROS's programs. Source: http://wiki.ros.org/tf/Debugging%20tools,
http://wiki.ros.org/tf2_ros, http://wiki.ros.org/tf2_tools.
"""

from minirospy.base.ros1_imports import prefer_ros1

# Its modules import messages of ROS 1, which are not the first of their names if ROS 2 is sourced.
prefer_ros1()
