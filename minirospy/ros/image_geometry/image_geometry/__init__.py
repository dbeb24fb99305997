"""image_geometry: from pixels to rays and back, with a camera's calibration. Source: http://wiki.ros.org/image_geometry."""

from minirospy.ros.image_geometry.image_geometry.cameramodels import PinholeCameraModel, StereoCameraModel

__all__ = ["PinholeCameraModel", "StereoCameraModel"]
