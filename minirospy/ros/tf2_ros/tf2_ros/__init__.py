"""Frames as nodes use them: buffers, listeners, broadcasters, buffer servers and clients, on the public node API.

The way of a transform: broadcasters `sendTransform` -> topic /tf ==> listener `callback` -> core `insert_message` ->
`minirospy.core.tf2`, which answers `lookup_transform`. What `import tf2_ros` and `import tf2_py` re-export.
"""

from minirospy.base.ros1_imports import prefer_ros1

# Its modules import messages of ROS 1, which are not the first of their names where ROS 2 is sourced.
prefer_ros1()
