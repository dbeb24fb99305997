"""ros_numpy: converts messages to numpy arrays and back. Source: http://wiki.ros.org/ros_numpy.

``numpify(message)`` and ``msgify(class, array)`` select the conversion by message type; programs add conversions with the
decorators ``converts_to_numpy(class)`` and ``converts_from_numpy(class)``.
"""
