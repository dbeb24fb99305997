"""ros_numpy: converts messages to numpy arrays and back. Source: http://wiki.ros.org/ros_numpy.

``numpify(message)`` and ``msgify(class, array)`` select the conversion by message type. Programs add conversions with the
decorators ``converts_to_numpy(class)`` and ``converts_from_numpy(class)``.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from minirospy.ros.ros_numpy.ros_numpy import geometry as geometry
    from minirospy.ros.ros_numpy.ros_numpy import image as image
    from minirospy.ros.ros_numpy.ros_numpy import occupancy_grid as occupancy_grid
    from minirospy.ros.ros_numpy.ros_numpy import point_cloud2 as point_cloud2
    from minirospy.ros.ros_numpy.ros_numpy import registry as registry
    from minirospy.ros.ros_numpy.ros_numpy.registry import (
        converts_from_numpy,
        converts_to_numpy,
        msgify,
        numpify,
    )
    from minirospy.ros.rospy.rospy.numpy_msg import numpy_msg

__all__ = ["converts_from_numpy", "converts_to_numpy", "msgify", "numpify", "numpy_msg"]
