"""camera_info_manager.zoom_camera_info_manager, provided by minirospy. Source: http://wiki.ros.org/camera_info_manager_py."""

from minirospy.ros.camera_info_manager_py.camera_info_manager.zoom_camera_info_manager import (
    ApproximateZoomCameraInfoManager,
    InterpolatingZoomCameraInfoManager,
    ZoomCameraInfoManager,
)

__all__ = [
    "ApproximateZoomCameraInfoManager",
    "InterpolatingZoomCameraInfoManager",
    "ZoomCameraInfoManager",
]
