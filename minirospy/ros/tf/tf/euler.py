"""Converts between Euler angles and rotations, with the 24 axis sequences. euler_from_quaternion needs no numpy.

An axes string consists of a frame (s: static, r: rotating) and three axes in the order of the rotations. The algorithm,
based on (first axis, parity, repetition, frame), is Shoemake's, "Euler angle conversion", Graphics Gems IV (1994).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy
    from numpy.typing import ArrayLike, NDArray

__all__ = [
    "AXES_TO_TUPLE",
    "EPSILON",
    "NEXT_AXIS",
    "TUPLE_TO_AXES",
    "euler_from_matrix",
    "euler_from_quaternion",
    "euler_matrix",
    "quaternion_from_euler",
    "rotation_rows",
]

EPSILON = 4.0 * 2.220446049250313e-16  # four times the machine epsilon of a float
NEXT_AXIS = [1, 2, 0, 1]
Axes = str | tuple[int, int, int, int]


def _sequences() -> dict[str, tuple[int, int, int, int]]:
    """Return a dict from each axes string to its (first axis, parity, repetition, frame).

    The angles about rotating axes are the angles about static axes in reverse order.
    """
    found = {}
    for first in range(3):
        for parity in (0, 1):
            second = NEXT_AXIS[first + parity]
            for repetition in (0, 1):
                last = first if repetition else NEXT_AXIS[first - parity + 1]
                letters = "".join("xyz"[axis] for axis in (first, second, last))
                found["s" + letters] = (first, parity, repetition, 0)
    rotating = {
        "r" + key[:0:-1]: (first, parity, repetition, 1)
        for key, (first, parity, repetition, _) in found.items()
    }
    return found | rotating


AXES_TO_TUPLE = _sequences()
TUPLE_TO_AXES = {value: key for key, value in AXES_TO_TUPLE.items()}


def euler_matrix(ai: float, aj: float, ak: float, axes: Axes = "sxyz") -> NDArray[numpy.float64]:
    """Return the 4x4 matrix of three rotations in radians; ``axes``, a string or a tuple, gives their order.

    Raise KeyError if ``axes`` is unknown.
    """
    import numpy

    first, parity, repetition, frame = _tuple(axes)
    i, j, k = _order(first, parity)
    if frame:
        ai, ak = ak, ai
    if parity:
        ai, aj, ak = -ai, -aj, -ak
    si, sj, sk = math.sin(ai), math.sin(aj), math.sin(ak)
    ci, cj, ck = math.cos(ai), math.cos(aj), math.cos(ak)

    matrix = numpy.identity(4)
    if repetition:
        matrix[i, i], matrix[i, j], matrix[i, k] = cj, sj * si, sj * ci
        matrix[j, i], matrix[j, j], matrix[j, k] = sj * sk, ci * ck - cj * si * sk, -si * ck - cj * ci * sk
        matrix[k, i], matrix[k, j], matrix[k, k] = -sj * ck, ci * sk + cj * si * ck, cj * ci * ck - si * sk
    else:
        matrix[i, i], matrix[i, j], matrix[i, k] = cj * ck, sj * si * ck - ci * sk, sj * ci * ck + si * sk
        matrix[j, i], matrix[j, j], matrix[j, k] = cj * sk, sj * si * sk + ci * ck, sj * ci * sk - si * ck
        matrix[k, i], matrix[k, j], matrix[k, k] = -sj, cj * si, cj * ci
    return matrix


def euler_from_matrix(matrix: ArrayLike, axes: Axes = "sxyz") -> tuple[float, float, float]:
    """Return three Euler angles for a rotation matrix, 3x3 or larger. If there are several solutions, return one.

    Raise KeyError if ``axes`` is unknown.
    """
    import numpy

    rows: list[list[float]] = numpy.asarray(matrix, dtype=numpy.float64)[:3, :3].tolist()
    return _angles(rows, axes)


def euler_from_quaternion(
    quaternion: Sequence[float] | NDArray[numpy.float64], axes: Axes = "sxyz"
) -> tuple[float, float, float]:
    """Return the three Euler angles of a quaternion [x, y, z, w], which need not be normalized.

    Raise KeyError if ``axes`` is unknown, ValueError if the quaternion does not have four numbers.
    """
    return _angles(rotation_rows(quaternion), axes)


def quaternion_from_euler(ai: float, aj: float, ak: float, axes: Axes = "sxyz") -> NDArray[numpy.float64]:
    """Return the quaternion [x, y, z, w] of three rotations in radians. Raise KeyError if ``axes`` is unknown."""
    import numpy

    first, parity, repetition, frame = _tuple(axes)
    i, j, k = _order(first, parity)
    if frame:
        ai, ak = ak, ai
    if parity:
        aj = -aj
    ci, cj, ck = math.cos(ai / 2.0), math.cos(aj / 2.0), math.cos(ak / 2.0)
    si, sj, sk = math.sin(ai / 2.0), math.sin(aj / 2.0), math.sin(ak / 2.0)

    quaternion = numpy.empty(4)
    if repetition:
        quaternion[i] = cj * (ci * sk + si * ck)
        quaternion[j] = sj * (ci * ck + si * sk)
        quaternion[k] = sj * (ci * sk - si * ck)
        quaternion[3] = cj * (ci * ck - si * sk)
    else:
        quaternion[i] = cj * si * ck - sj * ci * sk
        quaternion[j] = cj * si * sk + sj * ci * ck
        quaternion[k] = cj * ci * sk - sj * si * ck
        quaternion[3] = cj * ci * ck + sj * si * sk
    if parity:
        quaternion[j] *= -1
    return quaternion


def rotation_rows(quaternion: Sequence[float] | NDArray[numpy.float64]) -> list[list[float]]:
    """Return the rows of the 3x3 matrix for a quaternion of any length; a zero quaternion gives the identity."""
    x, y, z, w = (float(each) for each in quaternion[:4])
    square = x * x + y * y + z * z + w * w
    if square < EPSILON:
        return [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    s = 2.0 / square
    return [
        [1.0 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
        [s * (x * y + z * w), 1.0 - s * (x * x + z * z), s * (y * z - x * w)],
        [s * (x * z - y * w), s * (y * z + x * w), 1.0 - s * (x * x + y * y)],
    ]


def _angles(m: list[list[float]], axes: Axes) -> tuple[float, float, float]:
    first, parity, repetition, frame = _tuple(axes)
    i, j, k = _order(first, parity)
    if repetition:
        sine = math.hypot(m[i][j], m[i][k])
        middle = math.atan2(sine, m[i][i])
        is_regular = sine > EPSILON
        ends = (m[i][j], m[i][k], m[j][i], -m[k][i])
    else:
        cosine = math.hypot(m[i][i], m[j][i])
        middle = math.atan2(-m[k][i], cosine)
        is_regular = cosine > EPSILON
        ends = (m[k][j], m[k][k], m[j][i], m[i][i])

    if is_regular:
        ax, az = math.atan2(ends[0], ends[1]), math.atan2(ends[2], ends[3])
    else:
        # Gimbal lock: two of the axes coincide, so put the whole rotation into the first angle.
        ax, az = math.atan2(-m[j][k], m[j][j]), 0.0
    if parity:
        ax, middle, az = -ax, -middle, -az
    return (az, middle, ax) if frame else (ax, middle, az)


def _tuple(axes: str | tuple[int, int, int, int]) -> tuple[int, int, int, int]:
    if isinstance(axes, str) and axes.lower() in AXES_TO_TUPLE:
        return AXES_TO_TUPLE[axes.lower()]
    return AXES_TO_TUPLE[TUPLE_TO_AXES[axes]]  # type: ignore[index]  # another text raises KeyError


def _order(first: int, parity: int) -> tuple[int, int, int]:
    return first, NEXT_AXIS[first + parity], NEXT_AXIS[first - parity + 1]
