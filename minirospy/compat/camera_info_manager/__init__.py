"""camera_info_manager: a camera driver's calibration, kept in a file. Source: http://wiki.ros.org/camera_info_manager_py."""

from minirospy.compat.camera_info_manager.camera_info_manager import (
    CameraInfoError,
    CameraInfoManager,
    CameraInfoMissingError,
    genCameraName,
    getPackageFileName,
    loadCalibrationFile,
    parseURL,
    resolveURL,
    saveCalibration,
    saveCalibrationFile,
)

__all__ = [
    "CameraInfoError",
    "CameraInfoManager",
    "CameraInfoMissingError",
    "genCameraName",
    "getPackageFileName",
    "loadCalibrationFile",
    "parseURL",
    "resolveURL",
    "saveCalibration",
    "saveCalibrationFile",
]
