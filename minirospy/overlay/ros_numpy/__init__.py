"""ros_numpy, provided by minirospy: messages as numpy arrays. Source: http://wiki.ros.org/ros_numpy."""

from rospy.numpy_msg import numpy_msg

from minirospy.ros.ros_numpy.ros_numpy.registry import converts_from_numpy, converts_to_numpy, msgify, numpify
from ros_numpy import geometry as geometry
from ros_numpy import image as image
from ros_numpy import occupancy_grid as occupancy_grid
from ros_numpy import point_cloud2 as point_cloud2
from ros_numpy import registry as registry

__all__ = ["converts_from_numpy", "converts_to_numpy", "msgify", "numpify", "numpy_msg"]
