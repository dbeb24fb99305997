"""Composite transformation matrices (decompose, compose, fit to points), and a virtual trackball.

Each function imports numpy when the function is called.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, TypeAlias, TypeVar

from minirospy.ros.tf.tf.euler import EPSILON, euler_matrix
from minirospy.ros.tf.tf.vectors import (
    quaternion_matrix,
    quaternion_multiply,
    quaternion_slerp,
    unit_vector,
    vector_norm,
)

if TYPE_CHECKING:
    import numpy
    from numpy.typing import ArrayLike, NDArray

    Floats: TypeAlias = NDArray[numpy.float64]  # vectors and matrices

__all__ = [
    "Arcball",
    "arcball_constrain_to_axis",
    "arcball_map_to_sphere",
    "arcball_nearest_axis",
    "compose_matrix",
    "concatenate_matrices",
    "decompose_matrix",
    "inverse_matrix",
    "is_same_transform",
    "orthogonalization_matrix",
    "superimposition_matrix",
]

_Axis = TypeVar("_Axis", bound="ArrayLike")


def concatenate_matrices(*matrices: ArrayLike) -> Floats:
    """Return the product of the matrices; the last one is applied first."""
    import numpy

    return functools.reduce(numpy.dot, matrices, numpy.identity(4))


def inverse_matrix(matrix: ArrayLike) -> Floats:
    """Return the inverse matrix. Raise LinAlgError if the matrix is singular."""
    import numpy

    inverse: Floats = numpy.linalg.inv(numpy.asarray(matrix))
    return inverse


def is_same_transform(matrix0: ArrayLike, matrix1: ArrayLike) -> bool:
    """Return whether two matrices are the same up to a scale factor."""
    import numpy

    first, second = numpy.array(matrix0, dtype=numpy.float64), numpy.array(matrix1, dtype=numpy.float64)
    return bool(numpy.allclose(first / first[3, 3], second / second[3, 3]))


def decompose_matrix(matrix: ArrayLike) -> tuple[Floats, list[float], list[float], Floats, Floats]:
    """Return scale, shear (x-y, x-z, y-z), angles about the static axes, translation and perspective.

    Raise ValueError if the matrix cannot be decomposed. Source: Thomas, "Decomposing a matrix into simple
    transformations", Graphics Gems II (1991).
    """
    import numpy

    m = numpy.array(matrix, dtype=numpy.float64).T
    if abs(m[3, 3]) < EPSILON:
        raise ValueError("M[3, 3] is zero")
    m /= m[3, 3]
    affine = m.copy()
    affine[:, 3] = 0, 0, 0, 1
    if not numpy.linalg.det(affine):
        raise ValueError("Matrix is singular")

    perspective = numpy.array((0.0, 0.0, 0.0, 1.0))
    if any(abs(m[:3, 3]) > EPSILON):
        perspective = numpy.dot(m[:, 3], numpy.linalg.inv(affine.T))
    translate = m[3, :3].copy()

    # Gram-Schmidt process: the shear is a row's component along each earlier row.
    rows = m[:3, :3].copy()
    scale, shear = numpy.zeros(3), [0.0, 0.0, 0.0]
    scale[0] = vector_norm(rows[0])
    rows[0] /= scale[0]
    shear[0] = numpy.dot(rows[0], rows[1])
    rows[1] -= rows[0] * shear[0]
    scale[1] = vector_norm(rows[1])
    rows[1] /= scale[1]
    shear[0] /= scale[1]
    shear[1] = numpy.dot(rows[0], rows[2])
    rows[2] -= rows[0] * shear[1]
    shear[2] = numpy.dot(rows[1], rows[2])
    rows[2] -= rows[1] * shear[2]
    scale[2] = vector_norm(rows[2])
    rows[2] /= scale[2]
    shear[1] /= scale[2]
    shear[2] /= scale[2]
    if numpy.dot(rows[0], numpy.cross(rows[1], rows[2])) < 0:
        scale *= -1
        rows *= -1

    middle = math.asin(-rows[0, 2])
    if math.cos(middle):
        angles = [math.atan2(rows[1, 2], rows[2, 2]), middle, math.atan2(rows[0, 1], rows[0, 0])]
    else:
        angles = [math.atan2(-rows[2, 1], rows[1, 1]), middle, 0.0]
    return scale, shear, angles, translate, perspective


def compose_matrix(
    scale: ArrayLike | None = None,
    shear: ArrayLike | None = None,
    angles: ArrayLike | None = None,
    translate: ArrayLike | None = None,
    perspective: ArrayLike | None = None,
) -> Floats:
    """Compose a matrix; the arguments are the values that :func:`decompose_matrix` returns."""
    import numpy

    matrix = numpy.identity(4)
    if perspective is not None:
        part = numpy.identity(4)
        part[3, :] = numpy.asarray(perspective)[:4]
        matrix = numpy.dot(matrix, part)
    if translate is not None:
        part = numpy.identity(4)
        part[:3, 3] = numpy.asarray(translate)[:3]
        matrix = numpy.dot(matrix, part)
    if angles is not None:
        roll, pitch, yaw = numpy.asarray(angles)[:3]
        matrix = numpy.dot(matrix, euler_matrix(roll, pitch, yaw, "sxyz"))
    if shear is not None:
        part = numpy.identity(4)
        part[0, 1], part[0, 2], part[1, 2] = numpy.asarray(shear)[:3]
        matrix = numpy.dot(matrix, part)
    if scale is not None:
        matrix = numpy.dot(matrix, numpy.diag([*numpy.asarray(scale)[:3], 1.0]))
    matrix /= matrix[3, 3]
    return matrix


def orthogonalization_matrix(lengths: ArrayLike, angles: ArrayLike) -> Floats:
    """Return the matrix that converts a crystal cell's coordinates to orthogonal ones. The angles are in degrees."""
    import numpy

    a, b, c = numpy.asarray(lengths)[:3]
    radians = numpy.radians(angles)
    sin_a, sin_b, _ = numpy.sin(radians)
    cos_a, cos_b, cos_g = numpy.cos(radians)
    ratio = (cos_a * cos_b - cos_g) / (sin_a * sin_b)
    return numpy.array(
        [
            [a * sin_b * math.sqrt(1.0 - ratio * ratio), 0.0, 0.0, 0.0],
            [-a * sin_b * ratio, b * sin_a, 0.0, 0.0],
            [a * cos_b, b * cos_a, c, 0.0],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def superimposition_matrix(
    v0: ArrayLike, v1: ArrayLike, scaling: bool = False, usesvd: bool = True
) -> Floats:
    r"""Return the matrix that best maps points ``v0`` onto ``v1``: a rotation, a translation and, if requested, a scaling.

    Both have the shape (3, \*) or (4, \*), with at least three points. Uses Kabsch's method with singular values (1976), or
    Horn's with quaternions (1987). Raise ValueError if the shapes are different or too small.
    """
    import numpy

    first = numpy.array(v0, dtype=numpy.float64)[:3]
    second = numpy.array(v1, dtype=numpy.float64)[:3]
    if first.shape != second.shape or first.shape[1] < 3:
        raise ValueError("Vector sets are of wrong shape or type.")
    centre0, centre1 = first.mean(axis=1), second.mean(axis=1)
    first -= centre0.reshape(3, 1)
    second -= centre1.reshape(3, 1)

    matrix = numpy.identity(4)
    if usesvd:
        u, _, vh = numpy.linalg.svd(numpy.dot(second, first.T))
        rotation = numpy.dot(u, vh)
        if numpy.linalg.det(rotation) < 0.0:
            # A negative determinant means a reflection, so reverse the direction with the smallest singular value.
            rotation -= numpy.outer(u[:, 2], vh[2, :] * 2.0)
        matrix[:3, :3] = rotation
    else:
        matrix[:3, :3] = quaternion_matrix(_horn(first, second))[:3, :3]
    if scaling:
        matrix[:3, :3] *= math.sqrt(numpy.square(second).sum() / numpy.square(first).sum())
    matrix[:3, 3] = centre1 - numpy.dot(matrix[:3, :3], centre0)
    return matrix


def _horn(first: Floats, second: Floats) -> Floats:
    """Return the quaternion of the best-fit rotation: the eigenvector of Horn's matrix for its largest eigenvalue."""
    import numpy

    s = numpy.dot(first, second.T)
    xx, yy, zz = s.diagonal()
    n = numpy.array(
        [
            [xx + yy + zz, 0.0, 0.0, 0.0],
            [s[1, 2] - s[2, 1], xx - yy - zz, 0.0, 0.0],
            [s[2, 0] - s[0, 2], s[0, 1] + s[1, 0], -xx + yy - zz, 0.0],
            [s[0, 1] - s[1, 0], s[2, 0] + s[0, 2], s[1, 2] + s[2, 1], -xx - yy + zz],
        ]
    )
    values, vectors = numpy.linalg.eigh(n)
    w, x, y, z = vectors[:, values.argmax()]
    return unit_vector((x, y, z, w))


class Arcball:
    """A virtual trackball that converts mouse movements in a window to rotations. Source: Shoemake, Graphics Gems IV (1994)."""

    def __init__(self, initial: ArrayLike | None = None) -> None:
        """Start with the rotation ``initial``, a quaternion or a matrix. Raise ValueError for any other value."""
        import numpy

        from minirospy.ros.tf.tf.vectors import quaternion_from_matrix

        self._axes: list[Floats] | None = None
        self._axis: Floats | None = None
        self._radius = 1.0
        self._center: ArrayLike = [0.0, 0.0]
        self._vdown = numpy.array([0.0, 0.0, 1.0])
        self._constrain = False
        if initial is None:
            self._qdown = numpy.array([0.0, 0.0, 0.0, 1.0])
        else:
            given = numpy.array(initial, dtype=numpy.float64)
            if given.shape == (4, 4):
                self._qdown = quaternion_from_matrix(given)
            elif given.shape == (4,):
                self._qdown = given / vector_norm(given)
            else:
                raise ValueError("initial not a quaternion or matrix.")
        self._qnow = self._qpre = self._qdown

    def place(self, center: ArrayLike, radius: float) -> None:
        """Set the ball's center and radius, in window coordinates."""
        import numpy

        self._radius = float(radius)
        self._center = numpy.asarray(center, dtype=numpy.float64)[:2]

    def setaxes(self, *axes: ArrayLike) -> None:
        """Set the axes that rotations can be constrained to. Without arguments, remove the constraint."""
        self._axes = [unit_vector(axis) for axis in axes] if axes else None

    def setconstrain(self, constrain: bool) -> None:
        """Set whether rotations are constrained to the nearest axis."""
        self._constrain = constrain is True

    def getconstrain(self) -> bool:
        """Return whether rotations are constrained."""
        return self._constrain

    def down(self, point: ArrayLike) -> None:
        """Start a drag at a point in the window."""
        self._vdown = arcball_map_to_sphere(point, self._center, self._radius)
        self._qdown = self._qpre = self._qnow
        if self._constrain and self._axes is not None:
            self._axis = arcball_nearest_axis(self._vdown, self._axes)
            self._vdown = arcball_constrain_to_axis(self._vdown, self._axis)
        else:
            self._axis = None

    def drag(self, point: ArrayLike) -> None:
        """Continue the drag to another point."""
        import numpy

        now = arcball_map_to_sphere(point, self._center, self._radius)
        if self._axis is not None:
            now = arcball_constrain_to_axis(now, self._axis)
        self._qpre = self._qnow
        axis = numpy.cross(self._vdown, now)
        if numpy.dot(axis, axis) < EPSILON:
            self._qnow = self._qdown
        else:
            turn = [*axis, numpy.dot(self._vdown, now)]
            self._qnow = quaternion_multiply(turn, self._qdown)

    def next(self, acceleration: float = 0.0) -> None:
        """Continue the last drag's rotation."""
        self._qpre, self._qnow = (
            self._qnow,
            quaternion_slerp(self._qpre, self._qnow, 2.0 + acceleration, 0, False),
        )

    def matrix(self) -> Floats:
        """Return the current rotation as a 4x4 matrix."""
        return quaternion_matrix(self._qnow)


def arcball_map_to_sphere(point: ArrayLike, center: ArrayLike, radius: float) -> Floats:
    """Map a point in the window to the unit sphere. For a point outside the ball, return the nearest point on the rim."""
    import numpy

    at, centre = numpy.asarray(point), numpy.asarray(center)
    x, y = (at[0] - centre[0]) / radius, (centre[1] - at[1]) / radius
    square = x * x + y * y
    if square > 1.0:
        length = math.sqrt(square)
        return numpy.array((x / length, y / length, 0.0))
    return numpy.array((x, y, math.sqrt(1.0 - square)))


def arcball_constrain_to_axis(point: ArrayLike, axis: ArrayLike) -> Floats:
    """Return the point on the unit sphere that is perpendicular to ``axis`` and closest to ``point``."""
    import numpy

    along = numpy.array(axis, dtype=numpy.float64)
    moved = numpy.array(point, dtype=numpy.float64)
    moved -= along * numpy.dot(along, moved)
    length = vector_norm(moved)
    if length > EPSILON:
        if moved[2] < 0.0:
            moved *= -1.0
        moved /= length
        return moved
    if along[2] == 1.0:
        return numpy.array([1.0, 0.0, 0.0])
    return unit_vector([-along[1], along[0], 0.0])


def arcball_nearest_axis(point: ArrayLike, axes: Iterable[_Axis]) -> _Axis:
    """Return the axis whose great circle is nearest to a point."""
    import numpy

    place = numpy.asarray(point)
    return max(axes, key=lambda axis: numpy.dot(arcball_constrain_to_axis(place, axis), place))
