"""ros_numpy.image, provided by minirospy. Source: http://wiki.ros.org/ros_numpy."""

from minirospy.ros.ros_numpy.ros_numpy.image import image_to_numpy, numpy_to_image

__all__ = [
    "image_to_numpy",
    "numpy_to_image",
]
