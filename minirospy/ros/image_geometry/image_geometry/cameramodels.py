"""image_geometry.cameramodels: models of a single camera and of a stereo pair.

Pixels are (u, v), points are (x, y, z) in meters.

K is the raw image's camera matrix, D its distortion, R the rotation to the rectified image, P the rectified image's
projection. Source: http://wiki.ros.org/image_geometry, http://wiki.ros.org/image_pipeline/CameraInfo.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

from minirospy.ros.image_geometry.image_geometry.rectification import (
    Distortion,
    distorted,
    rectified_image,
    undistorted,
)

if TYPE_CHECKING:
    import genpy
    from numpy.typing import NDArray
    from sensor_msgs.msg import CameraInfo, RegionOfInterest

    Matrix: TypeAlias = Any  # a numpy.matrix of doubles, as in ROS
    Array: TypeAlias = NDArray[Any]
    Point: TypeAlias = Sequence[float]

__all__ = ["PinholeCameraModel", "StereoCameraModel", "mkmat"]


def mkmat(rows: int, cols: int, L: Sequence[float]) -> Matrix:
    """Return a matrix with these values, row by row. Raise ValueError if there are not ``rows`` x ``cols`` values."""
    import numpy as np

    return np.array(L, np.float64).reshape(rows, cols).view(np.matrix)


class PinholeCameraModel:
    """A camera described by a CameraInfo. K and P include binning and the region of interest."""

    def __init__(self) -> None:
        self.K: Matrix = None
        self.D: Matrix = None
        self.R: Matrix = None
        self.P: Matrix = None
        self.full_K: Matrix = None
        self.full_P: Matrix = None
        self.width: int | None = None
        self.height: int | None = None
        self.binning_x: int | None = None
        self.binning_y: int | None = None
        self.raw_roi: RegionOfInterest | None = None
        self.tf_frame: str | None = None
        self.stamp: genpy.Time | None = None

    def fromCameraInfo(self, msg: CameraInfo) -> None:
        """Set the camera's parameters from a CameraInfo."""
        self.K = mkmat(3, 3, msg.K)
        self.D = mkmat(len(msg.D), 1, msg.D) if msg.D else None
        self.R = mkmat(3, 3, msg.R)
        self.P = mkmat(3, 4, msg.P)
        self.full_K, self.full_P = self.K.copy(), self.P.copy()
        self.width, self.height = msg.width, msg.height
        self.resolution = (msg.width, msg.height)
        self.binning_x, self.binning_y = max(1, msg.binning_x), max(1, msg.binning_y)
        self.tf_frame, self.stamp = msg.header.frame_id, msg.header.stamp

        self.raw_roi = copy.copy(msg.roi)
        if not any((msg.roi.x_offset, msg.roi.y_offset, msg.roi.width, msg.roi.height)):
            self.raw_roi.width, self.raw_roi.height = self.width, self.height

        # First shift the principal point by the region's offset, then scale it by the binning.
        for matrix in (self.K, self.P):
            matrix[0, 2] -= self.raw_roi.x_offset
            matrix[1, 2] -= self.raw_roi.y_offset
            matrix[0, :3] /= self.binning_x
            matrix[1, :3] /= self.binning_y

    def rectifyImage(self, raw: Array, rectified: Array) -> None:
        """Rectify the image ``raw`` into ``rectified``, an array of the same shape and type.

        Use OpenCV if it is installed, else numpy with the same interpolation. Raise ValueError if the arrays do not
        match, or the camera is uncalibrated and has no image size.
        """
        self._check()
        rectified_image(raw, rectified, (self.K, self._distortion(), self.R, self.P), self.resolution)

    def rectifyPoint(self, uv_raw: Point) -> Array:
        """Convert a pixel in the raw image to the rectified image; return an array (u, v)."""
        self._check()
        return undistorted(uv_raw, self.K, self._distortion(), self.R, self.P)

    def unrectifyPoint(self, uv_rect: Point) -> Array:
        """Convert a pixel in the rectified image to the raw image, like the C++ class; return an array (u, v)."""
        import numpy as np

        self._check()
        u, v = (np.atleast_1d(np.float64(each)) for each in uv_rect)
        raw_u, raw_v = distorted(u, v, self.K, self._distortion(), self.R, self.P)
        return np.array([raw_u[0], raw_v[0]])

    def project3dToPixel(self, point: Point) -> tuple[float, float]:
        """Return a point's rectified pixel (u, v), or (nan, nan) if the point's depth is 0."""
        u, v, w = (float(row) for row in self._checked_P() @ [point[0], point[1], point[2], 1.0])
        return (u / w, v / w) if w != 0 else (math.nan, math.nan)

    def projectPixelTo3dRay(self, uv: Point) -> tuple[float, float, float]:
        """Return the unit vector from the camera's center through a rectified pixel."""
        self._check()
        x, y = _ratio(uv[0] - self.cx(), self.fx()), _ratio(uv[1] - self.cy(), self.fy())
        norm = math.sqrt(x * x + y * y + 1)
        return _ratio(x, norm), _ratio(y, norm), 1.0 / norm

    def getDeltaU(self, deltaX: float, Z: float) -> float:
        """Return the length in pixels of ``deltaX`` meters at distance ``Z``; inf if ``Z`` is 0."""
        return self.fx() * deltaX / Z if Z else math.inf

    def getDeltaV(self, deltaY: float, Z: float) -> float:
        """Return the length in pixels of ``deltaY`` meters at distance ``Z``; inf if ``Z`` is 0."""
        return self.fy() * deltaY / Z if Z else math.inf

    def getDeltaX(self, deltaU: float, Z: float) -> float:
        """Return the length in meters of ``deltaU`` pixels at distance ``Z``."""
        return _ratio(Z * deltaU, self.fx())

    def getDeltaY(self, deltaV: float, Z: float) -> float:
        """Return the length in meters of ``deltaV`` pixels at distance ``Z``."""
        return _ratio(Z * deltaV, self.fy())

    def fullResolution(self) -> tuple[int, int]:
        """Return (width, height) of the full sensor in pixels."""
        self._check()
        return self.resolution

    def intrinsicMatrix(self) -> Matrix:
        """Return the 3x3 camera matrix K. Like all matrices, it is None before ``fromCameraInfo``."""
        return self.K

    def distortionCoeffs(self) -> Matrix:
        """Return the distortion coefficients D as a column matrix, or None if there is no distortion."""
        return self.D

    def rotationMatrix(self) -> Matrix:
        """Return the 3x3 rotation matrix R."""
        return self.R

    def projectionMatrix(self) -> Matrix:
        """Return the 3x4 projection matrix P."""
        return self.P

    def fullIntrinsicMatrix(self) -> Matrix:
        """Return the camera matrix K for the full sensor."""
        return self.full_K

    def fullProjectionMatrix(self) -> Matrix:
        """Return the projection matrix P for the full sensor."""
        return self.full_P

    def cx(self) -> float:
        """Return the u coordinate of the principal point."""
        return self._of_P(0, 2)

    def cy(self) -> float:
        """Return the v coordinate of the principal point."""
        return self._of_P(1, 2)

    def fx(self) -> float:
        """Return the horizontal focal length in pixels."""
        return self._of_P(0, 0)

    def fy(self) -> float:
        """Return the vertical focal length in pixels."""
        return self._of_P(1, 1)

    def Tx(self) -> float:
        """Return the x translation in P: for the right camera of a pair, -fx times the baseline."""
        return self._of_P(0, 3)

    def Ty(self) -> float:
        """Return the y translation in P."""
        return self._of_P(1, 3)

    def fovX(self) -> float:
        """Return the horizontal field of view in radians."""
        return 2 * math.atan(_ratio(self.fullResolution()[0], 2 * self.fx()))

    def fovY(self) -> float:
        """Return the vertical field of view in radians."""
        return 2 * math.atan(_ratio(self.fullResolution()[1], 2 * self.fy()))

    def tfFrame(self) -> str | None:
        """Return the camera's frame ID."""
        return self.tf_frame

    def _of_P(self, row: int, column: int) -> float:
        value: float = self._checked_P()[row, column]
        return value

    def _checked_P(self) -> Array:
        self._check()
        array: Array = self.P.A
        return array

    def _check(self) -> None:
        if self.P is None:
            raise TypeError("the camera model is empty: call fromCameraInfo() first")

    def _distortion(self) -> Distortion:
        return () if self.D is None else self.D.A1


class StereoCameraModel:
    """A pair of rectified cameras. The baseline comes from the right camera's P."""

    def __init__(self) -> None:
        self.left = PinholeCameraModel()
        self.right = PinholeCameraModel()

    def fromCameraInfo(self, left_msg: CameraInfo, right_msg: CameraInfo) -> None:
        """Set both cameras' parameters from their CameraInfos."""
        import numpy as np

        self.left.fromCameraInfo(left_msg)
        self.right.fromCameraInfo(right_msg)
        fx, cx, cy = self.right.fx(), self.right.cx(), self.right.cy()
        baseline = _ratio(-self.right.Tx(), fx)

        self.Q: Array = np.zeros((4, 4))
        self.Q[0, 0] = self.Q[1, 1] = 1.0
        self.Q[0, 3], self.Q[1, 3], self.Q[2, 3] = -cx, -cy, fx
        self.Q[3, 2] = _ratio(1.0, baseline)

    def tfFrame(self) -> str | None:
        """Return the left camera's frame ID, which is also the frame of all points."""
        return self.left.tfFrame()

    def project3dToPixel(self, point: Point) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return a point's rectified pixels in the left and right images."""
        return self.left.project3dToPixel(point), self.right.project3dToPixel(point)

    def projectPixelTo3d(self, left_uv: Point, disparity: float) -> tuple[float, float, float]:
        """Return the point at a rectified pixel in the left image; (0, 0, 0) if the point is infinitely far away."""
        self._check()
        x, y, z, w = (float(row) for row in self.Q @ [left_uv[0], left_uv[1], disparity, 1.0])
        return (x / w, y / w, z / w) if w != 0 else (0.0, 0.0, 0.0)

    def getZ(self, disparity: float) -> float:
        """Return the distance in meters for a disparity in pixels; inf for 0."""
        return -self.right.Tx() / disparity if disparity else math.inf

    def getDisparity(self, Z: float) -> float:
        """Return the disparity in pixels for a distance in meters; inf for 0."""
        return -self.right.Tx() / Z if Z else math.inf

    def _check(self) -> None:
        if not hasattr(self, "Q"):
            raise TypeError("the camera model is empty: call fromCameraInfo() first")


def _ratio(above: float, below: float) -> float:
    """Divide two numbers; for a zero divisor, return inf or nan like numpy, but without a warning."""
    if below:
        return above / below
    if above == 0 or math.isnan(above):
        return math.nan
    return math.copysign(math.inf, above) * math.copysign(1.0, below)
