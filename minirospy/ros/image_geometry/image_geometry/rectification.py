"""Lens distortion for single points and for whole images, in numpy, with OpenCV's model and results. Pure.

Source: https://docs.opencv.org (calib3d: undistortPoints, initUndistortRectifyMap; imgproc: remap with INTER_CUBIC).
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Values: TypeAlias = NDArray[Any]
    # Distortion coefficients k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 s2 s3 s4 [tx ty]]]], or an empty sequence.
    Distortion: TypeAlias = Sequence[float] | Values
    Calibration: TypeAlias = tuple[Values, Distortion, Values, Values]  # K, D, R and P
else:
    Distortion = "Distortion"

__all__ = ["Distortion", "distorted", "rectified_image", "undistorted"]

_ITERATIONS = 5  # number of iterations, as in OpenCV's undistortPoints
_STEPS = 32  # subpixel positions per pixel, as in OpenCV's interpolation
_ONE = 1 << 15  # sum of the integer weights for a pixel's neighbors
_COUNTS = (0, 4, 5, 8, 12, 14)


def undistorted(uv: Sequence[float], K: Values, D: Distortion, R: Values, P: Values) -> Values:
    """Convert a pixel from the raw to the rectified image. Raise ValueError if D has an unsupported number of coefficients."""
    import numpy as np

    k = _coefficients(D)
    fx, fy, cx, cy = K[0, 0], K[1, 1], K[0, 2], K[1, 2]
    with np.errstate(all="ignore"):
        x0, y0 = (np.float64(uv[0]) - cx) / fx, (np.float64(uv[1]) - cy) / fy
        if k[12] or k[13]:
            tilted = np.linalg.inv(_tilt(k[12], k[13])) @ [x0, y0, 1.0]
            scale = 1 / tilted[2] if tilted[2] else 1.0
            x0, y0 = scale * tilted[0], scale * tilted[1]

        x, y = x0, y0
        for _ in range(_ITERATIONS if len(D) else 0):
            r2 = x * x + y * y
            inverse = (1 + ((k[7] * r2 + k[6]) * r2 + k[5]) * r2) / (
                1 + ((k[4] * r2 + k[1]) * r2 + k[0]) * r2
            )
            if inverse < 0:
                x, y = x0, y0
                break
            dx = 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x) + k[8] * r2 + k[9] * r2 * r2
            dy = k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y + k[10] * r2 + k[11] * r2 * r2
            x, y = (x0 - dx) * inverse, (y0 - dy) * inverse

        u, v, w = np.asarray(P)[:, :3] @ np.asarray(R) @ [x, y, 1.0]
        return np.array([u / w, v / w])


def distorted(u: Values, v: Values, K: Values, D: Distortion, R: Values, P: Values) -> tuple[Values, Values]:
    """Map rectified pixels to raw pixels; return the arrays u and v.

    Raise ValueError if the number of coefficients in D is not supported.
    """
    import numpy as np

    k = _coefficients(D)
    try:
        back = np.linalg.inv(np.asarray(P)[:, :3] @ np.asarray(R))
    except np.linalg.LinAlgError:
        back = np.zeros((3, 3))
    with np.errstate(all="ignore"):
        w = 1 / (back[2, 0] * u + back[2, 1] * v + back[2, 2])
        x = (back[0, 0] * u + back[0, 1] * v + back[0, 2]) * w
        y = (back[1, 0] * u + back[1, 1] * v + back[1, 2]) * w

        x2, y2, xy = x * x, y * y, 2 * x * y
        r2 = x2 + y2
        radial = (1 + ((k[4] * r2 + k[1]) * r2 + k[0]) * r2) / (1 + ((k[7] * r2 + k[6]) * r2 + k[5]) * r2)
        xd = x * radial + k[2] * xy + k[3] * (r2 + 2 * x2) + k[8] * r2 + k[9] * r2 * r2
        yd = y * radial + k[2] * (r2 + 2 * y2) + k[3] * xy + k[10] * r2 + k[11] * r2 * r2
        if k[12] or k[13]:
            tilt = _tilt(k[12], k[13])
            xt, yt, wt = (row[0] * xd + row[1] * yd + row[2] for row in tilt)
            wt = np.where(wt == 0, 1.0, wt)
            xd, yd = xt / wt, yt / wt
    return K[0, 0] * xd + K[0, 2], K[1, 1] * yd + K[1, 2]


def rectified_image(
    raw: Values, target: Values, calibration: Calibration, resolution: tuple[int, int]
) -> None:
    """Write the rectified image into ``target``. Raise ValueError if a size is zero or the arrays do not match."""
    import numpy as np

    width, height = resolution
    if not width or not height:
        raise ValueError("the camera's size is zero: its CameraInfo is empty")
    if raw.ndim not in (2, 3) or target.shape != (height, width, *raw.shape[2:]) or target.dtype != raw.dtype:
        raise ValueError(
            f"the rectified image of {raw.dtype} {raw.shape} has the type {raw.dtype} and the shape "
            f"{(height, width, *raw.shape[2:])}: the array given for it is {target.dtype} {target.shape}"
        )
    v, u = np.mgrid[:height, :width].astype(np.float64)
    map_x, map_y = (each.astype(np.float32) for each in distorted(u, v, *calibration))

    try:
        import cv2  # type: ignore[import-not-found,unused-ignore]
    except ImportError:
        target[...] = _remapped(raw, map_x, map_y)
    else:
        target[...] = cv2.remap(raw, map_x, map_y, cv2.INTER_CUBIC).reshape(target.shape)


def _coefficients(D: Distortion) -> list[float]:
    if len(D) not in _COUNTS:
        raise ValueError(f"D has {len(D)} coefficients: there are {', '.join(map(str, _COUNTS))}")
    return [float(each) for each in D] + [0.0] * (14 - len(D))


def _tilt(tau_x: float, tau_y: float) -> Values:
    """Return the matrix by which OpenCV models a sensor that is tilted relative to the lens."""
    import numpy as np

    cx, sx, cy, sy = math.cos(tau_x), math.sin(tau_x), math.cos(tau_y), math.sin(tau_y)
    turned = np.array([[cy, 0, -sy], [0, 1, 0], [sy, 0, cy]]) @ np.array(
        [[1, 0, 0], [0, cx, sx], [0, -sx, cx]]
    )
    onto = np.array([[turned[2, 2], 0, -turned[0, 2]], [0, turned[2, 2], -turned[1, 2]], [0, 0, 1]])
    matrix: Values = onto @ turned
    return matrix


def _remapped(raw: Values, map_x: Values, map_y: Values) -> Values:
    """Return ``raw`` sampled at the maps' positions with bicubic interpolation.

    Positions outside ``raw`` become black.
    """
    import numpy as np

    if raw.dtype not in (np.uint8, np.uint16, np.int16, np.float32, np.float64):
        raise ValueError(f"images of {raw.dtype} cannot be rectified")
    is_fixed = raw.dtype == np.uint8
    weights = _fixed_weights() if is_fixed else _weights().astype(np.float32)

    limit = np.float32(1 << 20)
    x, y = (
        np.rint(np.clip(np.nan_to_num(each * np.float32(_STEPS), nan=-limit), -limit, limit)).astype(np.int32)
        for each in (map_x, map_y)
    )
    chosen = weights[(y % _STEPS), (x % _STEPS)]
    x, y = x // _STEPS - 1, y // _STEPS - 1

    height, width = raw.shape[:2]
    total = np.zeros((*map_x.shape, *raw.shape[2:]), np.int32 if is_fixed else np.float64)
    for row in range(4):
        for column in range(4):
            at_x, at_y = x + column, y + row
            inside = (at_x >= 0) & (at_x < width) & (at_y >= 0) & (at_y < height)
            weight = np.where(inside, chosen[..., row, column], 0)
            pixels = raw[np.clip(at_y, 0, height - 1), np.clip(at_x, 0, width - 1)]
            total += (weight if raw.ndim == 2 else weight[..., None]) * pixels.astype(total.dtype)
    if is_fixed:
        total = np.clip((total + _ONE // 2) >> 15, 0, 255)
    elif raw.dtype.kind != "f":
        limits = np.iinfo(raw.dtype)
        total = np.clip(np.rint(total), limits.min, limits.max)
    return total.astype(raw.dtype)


def _weights() -> Values:
    """Return the weights for the 4x4 neighbors, with shape (_STEPS of v, _STEPS of u, 4, 4)."""
    import numpy as np

    a, x = np.float32(-0.75), (np.arange(_STEPS) / np.float32(_STEPS)).astype(np.float32)
    first = ((a * (x + 1) - 5 * a) * (x + 1) + 8 * a) * (x + 1) - 4 * a
    second = ((a + 2) * x - (a + 3)) * x * x + 1
    third = ((a + 2) * (1 - x) - (a + 3)) * (1 - x) * (1 - x) + 1
    line = np.stack([first, second, third, 1 - first - second - third], axis=-1).astype(np.float32)
    table: Values = line[:, None, :, None] * line[None, :, None, :]
    return table


@functools.cache
def _fixed_weights() -> Values:
    """Return the weights as integers that sum to ``_ONE``, with OpenCV's rounding."""
    import numpy as np

    table: Values = np.rint(_weights() * np.float32(_ONE)).astype(np.int32)
    # OpenCV adds the rounding error to the largest or smallest of these four weights.
    corner = table[:, :, 2:, 2:].reshape(_STEPS, _STEPS, 4)
    excess = table.sum(axis=(2, 3)) - _ONE
    places = np.where(excess < 0, corner.argmax(axis=2), corner.argmin(axis=2))
    rows, columns = np.indices(places.shape)
    table[rows, columns, 2 + places // 2, 2 + places % 2] -= excess
    return table
