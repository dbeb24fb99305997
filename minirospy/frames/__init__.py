"""Frames as nodes use them: buffers, listeners, broadcasters, buffer servers and clients, on the public node API.

The way of a transform: broadcasters `sendTransform` -> topic /tf ==> listener `callback` -> core `insert_message` ->
`minirospy.tf2`, which answers `lookup_transform`. What `import tf2_ros` and `import tf2_py` re-export.
"""
