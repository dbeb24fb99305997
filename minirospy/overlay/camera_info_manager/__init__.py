"""camera_info_manager, provided by minirospy. Source: http://wiki.ros.org/camera_info_manager_py."""

from camera_info_manager import camera_info_manager as camera_info_manager
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
