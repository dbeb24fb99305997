"""image_geometry, provided by minirospy: camera models. Source: http://wiki.ros.org/image_geometry."""

from image_geometry import cameramodels as cameramodels
from minirospy.ros.image_geometry.image_geometry import PinholeCameraModel, StereoCameraModel

__all__ = ["PinholeCameraModel", "StereoCameraModel"]
