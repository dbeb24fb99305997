"""ros_numpy: messages as numpy arrays, and back. Source: http://wiki.ros.org/ros_numpy.

``numpify(message)`` and ``msgify(class, array)`` choose the conversion by the type of the message; programs add their own
with the decorators ``converts_to_numpy(class)`` and ``converts_from_numpy(class)``.
"""
