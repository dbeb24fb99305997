"""The API of tf2_ros for nodes: buffers, listeners, broadcasters, buffer servers and clients, on the public node API.

The path of a transform: broadcaster `sendTransform` -> topic /tf ==> listener `callback` -> core `insert_message` ->
`minirospy.core.tf2`, which answers `lookup_transform`. `import tf2_ros` and `import tf2_py` re-export these names.
"""

from minirospy.base.ros1_imports import prefer_ros1

# The modules below import messages of ROS 1; if ROS 2 is sourced, its packages of the same names would come first.
prefer_ros1()
