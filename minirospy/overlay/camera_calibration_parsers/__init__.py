"""camera_calibration_parsers, provided by minirospy. Source: http://wiki.ros.org/camera_calibration_parsers."""

from minirospy.ros.camera_calibration_parsers.camera_calibration_parsers import (
    CameraInfo,
    readCalibration,
    writeCalibration,
)

__all__ = ["CameraInfo", "readCalibration", "writeCalibration"]
