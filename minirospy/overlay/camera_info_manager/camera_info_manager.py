"""camera_info_manager.camera_info_manager, provided by minirospy. Source: http://wiki.ros.org/camera_info_manager_py."""

from minirospy.ros.camera_info_manager_py.camera_info_manager.camera_info_manager import (
    CameraInfoError,
    CameraInfoManager,
    CameraInfoMissingError,
    URL_empty,
    URL_file,
    URL_invalid,
    URL_package,
    default_camera_info_url,
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
    "URL_empty",
    "URL_file",
    "URL_invalid",
    "URL_package",
    "default_camera_info_url",
    "genCameraName",
    "getPackageFileName",
    "loadCalibrationFile",
    "parseURL",
    "resolveURL",
    "saveCalibration",
    "saveCalibrationFile",
]
