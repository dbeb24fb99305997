"""ros_numpy.registry, provided by minirospy. Source: http://wiki.ros.org/ros_numpy."""

from minirospy.ros.ros_numpy.ros_numpy.registry import converts_from_numpy, converts_to_numpy, msgify, numpify

__all__ = [
    "converts_from_numpy",
    "converts_to_numpy",
    "msgify",
    "numpify",
]
