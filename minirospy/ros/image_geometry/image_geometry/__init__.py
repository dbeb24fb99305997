"""image_geometry: converts pixels to rays and back, using a camera's calibration. Source: http://wiki.ros.org/image_geometry."""

from minirospy.ros.image_geometry.image_geometry.cameramodels import PinholeCameraModel, StereoCameraModel

__all__ = ["PinholeCameraModel", "StereoCameraModel"]
