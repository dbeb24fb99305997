"""image_geometry.cameramodels, provided by minirospy. Source: http://wiki.ros.org/image_geometry."""

from minirospy.ros.image_geometry.image_geometry.cameramodels import (
    PinholeCameraModel,
    StereoCameraModel,
    mkmat,
)

__all__ = ["PinholeCameraModel", "StereoCameraModel", "mkmat"]
