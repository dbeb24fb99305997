"""camera_info_manager.zoom_camera_info_manager: calibrations for a camera with zoom.

Source: http://wiki.ros.org/camera_info_manager_py. The focal length is proportional to the zoom level, a number.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from copy import deepcopy
from math import radians, tan
from typing import TYPE_CHECKING

from sensor_msgs.msg import CameraInfo

from minirospy import client as rospy
from minirospy.ros.camera_info_manager_py.camera_info_manager.camera_info_manager import (
    CameraInfoError,
    CameraInfoManager,
    CameraInfoMissingError,
    URL_empty,
    URL_package,
    filename_of,
    loadCalibrationFile,
    parseURL,
    resolveURL,
)

if TYPE_CHECKING:
    from types import TracebackType

    from typing_extensions import Self

__all__ = ["ApproximateZoomCameraInfoManager", "InterpolatingZoomCameraInfoManager", "ZoomCameraInfoManager"]


class ZoomCameraInfoManager(CameraInfoManager):
    """The base class for cameras with zoom. Rejects zoom levels outside the limits.

    As a context manager, it stops the service on exit.
    """

    def __init__(
        self, min_zoom: float, max_zoom: float, cname: str = "camera", url: str = "", namespace: str = ""
    ) -> None:
        """Set the limits of the zoom level.

        ``url`` is the calibration at the lowest zoom level; for the other arguments see CameraInfoManager.
        """
        super().__init__(cname, url, namespace)
        self._min_zoom = min_zoom
        self._max_zoom = max_zoom
        self._zoom = min_zoom

    def set_zoom(self, zoom: float) -> None:
        """Compute the calibration for a zoom level. Raise CameraInfoError if the level is out of range."""
        if not self._min_zoom <= zoom <= self._max_zoom:
            raise CameraInfoError("Zoom got outside the allowed range")
        self._zoom = zoom
        self._update_camera_info()

    def _update_camera_info(self) -> None:
        """Recompute the calibration; subclasses override this method."""
        raise NotImplementedError

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.svc.shutdown()


class ApproximateZoomCameraInfoManager(ZoomCameraInfoManager):
    """Computes K from the fields of view at the minimum and maximum zoom.

    All other values are from the calibration file, if any.
    """

    def __init__(
        self,
        min_fov: float,
        max_fov: float,
        initial_image_width: int,
        initial_image_height: int,
        min_zoom: float,
        max_zoom: float,
        cname: str = "camera",
        url: str = "",
        namespace: str = "",
    ) -> None:
        """Set the fields of view at the minimum and maximum zoom.

        ``min_fov`` and ``max_fov`` are the horizontal fields of view in degrees, at the highest and at the lowest zoom level.
        """
        super().__init__(min_zoom, max_zoom, cname, url, namespace)
        self._min_fov = min_fov
        self._max_fov = max_fov
        self._image_width = initial_image_width
        self._image_height = initial_image_height
        self._loaded_camera_info: CameraInfo | None = None

    def loadCameraInfo(self) -> None:
        """Load the calibration, or an empty one if the file is missing."""
        super().loadCameraInfo()
        self._loaded_camera_info = deepcopy(self.camera_info)

    def set_resolution(self, width: int, height: int) -> None:
        """Compute the calibration for another image size in pixels."""
        self._image_width, self._image_height = width, height
        self._update_camera_info()

    def _update_camera_info(self) -> None:
        loaded = self._loaded_camera_info
        if loaded is None:
            return
        width, height = self._image_width, self._image_height
        levels = self._max_zoom - self._min_zoom
        share = (self._zoom - self._min_zoom) / levels if levels else 0.0
        horizontal = radians(self._max_fov + (self._min_fov - self._max_fov) * share)
        vertical = horizontal * height / width

        info = deepcopy(loaded)
        info.width, info.height = width, height
        matrix = list(loaded.K)
        matrix[0] = width / (2 * tan(horizontal / 2))
        matrix[4] = height / (2 * tan(vertical / 2))
        matrix[8] = 1.0
        # Scale a calibrated center with the image size; otherwise use the image center.
        is_calibrated = matrix[2] != 0.0 and loaded.width and loaded.height
        matrix[2] = matrix[2] * width / loaded.width if is_calibrated else width / 2
        matrix[5] = matrix[5] * height / loaded.height if is_calibrated else height / 2
        info.K = matrix
        self.camera_info = info


class InterpolatingZoomCameraInfoManager(ZoomCameraInfoManager):
    """Uses calibrations for some zoom levels, and interpolates linearly between them."""

    def __init__(
        self,
        calibration_url_template: str,
        zoom_levels: Collection[int],
        cname: str = "camera",
        url: str = "",
        namespace: str = "",
    ) -> None:
        """Set the calibrated zoom levels. ``calibration_url_template`` is a URL with ``%d`` in place of the level."""
        super().__init__(min(zoom_levels), max(zoom_levels), cname, url, namespace)
        self._calibration_url_template = calibration_url_template
        self._zoom_levels = zoom_levels
        self._camera_infos: dict[int, CameraInfo] | None = None

    def loadCameraInfo(self) -> None:
        """Load all calibrations.

        Raise CameraInfoMissingError if their package is missing, CameraInfoError if there are fewer than two zoom levels.
        """
        super().loadCameraInfo()
        self._camera_infos = {level: self._load(level) for level in self._zoom_levels}
        if len(self._camera_infos) < 2:
            raise CameraInfoError(
                "Interpolating zoom camera info manager needs at least two calibrations to exist."
            )

    def _load(self, level: int) -> CameraInfo:
        url = resolveURL(self._calibration_url_template % level, self.cname)
        kind = parseURL(url)
        if kind == URL_empty:
            raise CameraInfoError("Zoom camera cannot use default calibration URLs.")
        rospy.loginfo("camera calibration URL for zoom level %d: %s", level, url)
        filename = filename_of(url, self.cname)
        if filename is not None:
            return loadCalibrationFile(filename, self.cname)
        if kind == URL_package:
            raise CameraInfoMissingError("Calibration package missing.")
        return CameraInfo()

    def _update_camera_info(self) -> None:
        infos = self._camera_infos
        if not self.isCalibrated() or infos is None:
            return
        lower = max(level for level in infos if level <= self._zoom)
        upper = min(level for level in infos if level >= self._zoom)
        info = deepcopy(infos[lower])
        if lower != upper:
            share = (self._zoom - lower) / (upper - lower)
            for name in ("K", "P", "R", "D"):
                setattr(info, name, _between(getattr(info, name), getattr(infos[upper], name), share))
        self.camera_info = info


def _between(low: Sequence[float], high: Sequence[float], share: float) -> list[float]:
    """Interpolate between two arrays: return ``low`` for ``share`` 0, ``high`` for ``share`` 1."""
    return [(1 - share) * left + share * right for left, right in zip(low, high, strict=False)]
