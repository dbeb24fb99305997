"""camera_info_manager: manages a camera driver's calibration file. Source: http://wiki.ros.org/camera_info_manager_py."""

from minirospy.ros.camera_info_manager_py.camera_info_manager.camera_info_manager import (
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
from minirospy.ros.camera_info_manager_py.camera_info_manager.zoom_camera_info_manager import (
    ApproximateZoomCameraInfoManager,
    InterpolatingZoomCameraInfoManager,
    ZoomCameraInfoManager,
)

__all__ = [
    "ApproximateZoomCameraInfoManager",
    "CameraInfoError",
    "CameraInfoManager",
    "CameraInfoMissingError",
    "InterpolatingZoomCameraInfoManager",
    "ZoomCameraInfoManager",
    "genCameraName",
    "getPackageFileName",
    "loadCalibrationFile",
    "parseURL",
    "resolveURL",
    "saveCalibration",
    "saveCalibrationFile",
]
