"""camera_info_manager: manages a camera driver's calibration file. Source: http://wiki.ros.org/camera_info_manager_py."""

from typing import TYPE_CHECKING

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

if TYPE_CHECKING:
    from minirospy.ros.camera_info_manager_py.camera_info_manager import (
        camera_info_manager as camera_info_manager,
    )
    from minirospy.ros.camera_info_manager_py.camera_info_manager import (
        zoom_camera_info_manager as zoom_camera_info_manager,
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
