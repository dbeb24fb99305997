"""image_geometry: converts pixels to rays and back, using a camera's calibration. Source: http://wiki.ros.org/image_geometry."""

from typing import TYPE_CHECKING

from minirospy.ros.image_geometry.image_geometry.cameramodels import PinholeCameraModel, StereoCameraModel

if TYPE_CHECKING:
    from minirospy.ros.image_geometry.image_geometry import cameramodels as cameramodels

__all__ = ["PinholeCameraModel", "StereoCameraModel"]
