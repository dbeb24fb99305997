"""Builds homogeneous 4x4 matrices for single transformations, and recovers the parameters from a matrix.

A plane is given by a point and a normal. Each function imports numpy when it is called.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, TypeAlias

from minirospy.ros.tf.tf.euler import EPSILON
from minirospy.ros.tf.tf.vectors import unit_vector, vector_norm

if TYPE_CHECKING:
    import numpy
    from numpy.typing import ArrayLike, NDArray

    Floats: TypeAlias = NDArray[numpy.float64]  # vectors and matrices

__all__ = [
    "clip_matrix",
    "identity_matrix",
    "projection_from_matrix",
    "projection_matrix",
    "reflection_from_matrix",
    "reflection_matrix",
    "rotation_from_matrix",
    "rotation_matrix",
    "scale_from_matrix",
    "scale_matrix",
    "shear_from_matrix",
    "shear_matrix",
    "translation_from_matrix",
    "translation_matrix",
]

_NEAR = 1e-8


def identity_matrix() -> Floats:
    """Return the 4x4 identity matrix."""
    import numpy

    return numpy.identity(4, dtype=numpy.float64)


def translation_matrix(direction: ArrayLike) -> Floats:
    """Return the matrix that translates by a vector."""
    import numpy

    matrix = numpy.identity(4)
    matrix[:3, 3] = numpy.asarray(direction)[:3]
    return matrix


def translation_from_matrix(matrix: ArrayLike) -> Floats:
    """Return a matrix's translation vector."""
    import numpy

    moved: Floats = numpy.array(matrix)[:3, 3].copy()
    return moved


def reflection_matrix(point: ArrayLike, normal: ArrayLike) -> Floats:
    """Return the matrix for a reflection in a plane."""
    import numpy

    across = unit_vector(numpy.asarray(normal)[:3])
    matrix = numpy.identity(4)
    matrix[:3, :3] -= 2.0 * numpy.outer(across, across)
    matrix[:3, 3] = 2.0 * numpy.dot(numpy.asarray(point)[:3], across) * across
    return matrix


def reflection_from_matrix(matrix: ArrayLike) -> tuple[Floats, Floats]:
    """Return a point in a reflection's plane and the plane's normal. Raise ValueError if the matrix is not a reflection."""
    import numpy

    m = numpy.asarray(matrix, dtype=numpy.float64)
    normal = _eigenvector(m[:3, :3], -1.0, "no unit eigenvector corresponding to eigenvalue -1", last=False)
    point = _eigenvector(m, 1.0, "no unit eigenvector corresponding to eigenvalue 1")
    return point / point[3], normal


def rotation_matrix(angle: float, direction: ArrayLike, point: ArrayLike | None = None) -> Floats:
    """Return the matrix that rotates by ``angle`` radians about an axis through ``point`` (default: the origin)."""
    import numpy

    sine, cosine = math.sin(angle), math.cos(angle)
    axis = unit_vector(numpy.asarray(direction)[:3])
    x, y, z = axis
    matrix = numpy.identity(4)
    matrix[:3, :3] = cosine * numpy.identity(3) + (1.0 - cosine) * numpy.outer(axis, axis)
    matrix[:3, :3] += sine * numpy.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    if point is not None:
        centre = numpy.asarray(point, dtype=numpy.float64)[:3]
        matrix[:3, 3] = centre - numpy.dot(matrix[:3, :3], centre)
    return matrix


def rotation_from_matrix(matrix: ArrayLike) -> tuple[float, Floats, Floats]:
    """Return a rotation's angle, axis, and a point on the axis. Raise ValueError if the matrix is not a rotation."""
    import numpy

    m = numpy.asarray(matrix, dtype=numpy.float64)
    missing = "no unit eigenvector corresponding to eigenvalue 1"
    axis = _eigenvector(m[:3, :3].T, 1.0, missing)
    point = _eigenvector(m, 1.0, missing)

    cosine = (numpy.trace(m[:3, :3]) - 1.0) / 2.0
    x, y, z = axis
    if abs(z) > _NEAR:
        sine = (m[1, 0] + (cosine - 1.0) * x * y) / z
    elif abs(y) > _NEAR:
        sine = (m[0, 2] + (cosine - 1.0) * x * z) / y
    else:
        sine = (m[2, 1] + (cosine - 1.0) * y * z) / x
    return math.atan2(sine, cosine), axis, point / point[3]


def scale_matrix(
    factor: float, origin: ArrayLike | None = None, direction: ArrayLike | None = None
) -> Floats:
    """Return the matrix that scales about ``origin``, uniformly or along ``direction``. A factor of -1 is a point reflection."""
    import numpy

    matrix = numpy.identity(4)
    if direction is None:
        matrix[:3, :3] *= factor
        if origin is not None:
            matrix[:3, 3] = numpy.asarray(origin)[:3]
            matrix[:3, 3] *= 1.0 - factor
        return matrix
    along = unit_vector(numpy.asarray(direction)[:3])
    matrix[:3, :3] -= (1.0 - factor) * numpy.outer(along, along)
    if origin is not None:
        matrix[:3, 3] = (1.0 - factor) * numpy.dot(numpy.asarray(origin)[:3], along) * along
    return matrix


def scale_from_matrix(matrix: ArrayLike) -> tuple[float, Floats, Floats | None]:
    """Return the factor, origin and direction of a scaling matrix.

    Raise ValueError if the matrix is not a scaling. The direction is None for a uniform scaling.
    """
    import numpy

    m = numpy.asarray(matrix, dtype=numpy.float64)
    factor = numpy.trace(m[:3, :3]) - 2.0
    values, vectors = numpy.linalg.eig(m[:3, :3])
    (found,) = numpy.where(abs(numpy.real(values) - factor) < _NEAR)
    direction = None
    if len(found):
        direction = numpy.real(vectors[:, found[0]]).squeeze()
        direction /= vector_norm(direction)
    else:
        factor = (factor + 2.0) / 3.0
    origin = _eigenvector(m, 1.0, "no eigenvector corresponding to eigenvalue 1")
    return factor, origin / origin[3], direction


def projection_matrix(
    point: ArrayLike,
    normal: ArrayLike,
    direction: ArrayLike | None = None,
    perspective: ArrayLike | None = None,
    pseudo: bool = False,
) -> Floats:
    """Return the matrix that projects onto a plane: from a perspective point, along a direction, or at right angles.

    If ``pseudo``, a perspective projection preserves relative depths.
    """
    import numpy

    matrix = numpy.identity(4)
    place = numpy.asarray(point, dtype=numpy.float64)[:3]
    across = unit_vector(numpy.asarray(normal)[:3])
    if perspective is not None:
        eye = numpy.asarray(perspective, dtype=numpy.float64)[:3]
        depth = numpy.dot(eye - place, across)
        matrix[:3, :3] = depth * numpy.identity(3) - numpy.outer(eye, across)
        if pseudo:
            matrix[:3, :3] -= numpy.outer(across, across)
            matrix[:3, 3] = numpy.dot(place, across) * (eye + across)
        else:
            matrix[:3, 3] = numpy.dot(place, across) * eye
        matrix[3, :3] = -across
        matrix[3, 3] = numpy.dot(eye, across)
        return matrix
    if direction is not None:
        along = numpy.asarray(direction, dtype=numpy.float64)[:3]
        scale = numpy.dot(along, across)
        matrix[:3, :3] -= numpy.outer(along, across) / scale
        matrix[:3, 3] = along * (numpy.dot(place, across) / scale)
        return matrix
    matrix[:3, :3] -= numpy.outer(across, across)
    matrix[:3, 3] = numpy.dot(place, across) * across
    return matrix


def projection_from_matrix(
    matrix: ArrayLike, pseudo: bool = False
) -> tuple[Floats, Floats, Floats | None, Floats | None, bool]:
    """Return the :func:`projection_matrix` arguments for a matrix. Raise ValueError if the matrix is not a projection."""
    import numpy

    m = numpy.asarray(matrix, dtype=numpy.float64)
    values, vectors = numpy.linalg.eig(m)
    (unit,) = numpy.where(abs(numpy.real(values) - 1.0) < _NEAR)
    if not pseudo and len(unit):
        point = numpy.real(vectors[:, unit[-1]]).squeeze()
        point /= point[3]
        missing = "no eigenvector corresponding to eigenvalue 0"
        direction = _eigenvector(m[:3, :3], 0.0, missing, last=False)
        direction /= vector_norm(direction)
        normal = _eigenvector(m[:3, :3].T, 0.0, missing, last=False)
        return point, normal / vector_norm(normal), direction, None, False

    (found,) = numpy.where(abs(numpy.real(values)) > _NEAR)
    if not len(found):
        raise ValueError("no eigenvector not corresponding to eigenvalue 0")
    point = numpy.real(vectors[:, found[-1]]).squeeze()
    point /= point[3]
    normal = -m[3, :3]
    eye = m[:3, 3] / numpy.dot(point[:3], normal)
    if pseudo:
        eye -= normal
    return point, normal, None, eye, pseudo


def clip_matrix(
    left: float, right: float, bottom: float, top: float, near: float, far: float, perspective: bool = False
) -> Floats:
    """Return the matrix that maps a view volume to the cube from -1 to 1. Raise ValueError if the volume is invalid.

    If ``perspective``, the volume is a frustum.
    """
    import numpy

    if left >= right or bottom >= top or near >= far:
        raise ValueError("invalid frustrum")
    width, height, depth = right - left, top - bottom, far - near
    if perspective:
        if near <= EPSILON:
            raise ValueError("invalid frustrum: near <= 0")
        return numpy.array(
            [
                [-2.0 * near / width, 0.0, (right + left) / width, 0.0],
                [0.0, -2.0 * near / height, (top + bottom) / height, 0.0],
                [0.0, 0.0, -(far + near) / depth, 2.0 * near * far / depth],
                [0.0, 0.0, -1.0, 0.0],
            ]
        )
    return numpy.array(
        [
            [2.0 / width, 0.0, 0.0, -(right + left) / width],
            [0.0, 2.0 / height, 0.0, -(top + bottom) / height],
            [0.0, 0.0, 2.0 / depth, -(far + near) / depth],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def shear_matrix(angle: float, direction: ArrayLike, point: ArrayLike, normal: ArrayLike) -> Floats:
    """Return the matrix that shears by ``angle`` (radians) along a direction within a plane.

    Raise ValueError if the direction is not in the plane.
    """
    import numpy

    across = unit_vector(numpy.asarray(normal)[:3])
    along = unit_vector(numpy.asarray(direction)[:3])
    if abs(numpy.dot(across, along)) > 1e-6:
        raise ValueError("direction and normal vectors are not orthogonal")
    slope = math.tan(angle)
    matrix = numpy.identity(4)
    matrix[:3, :3] += slope * numpy.outer(along, across)
    matrix[:3, 3] = -slope * numpy.dot(numpy.asarray(point)[:3], across) * along
    return matrix


def shear_from_matrix(matrix: ArrayLike) -> tuple[float, Floats, Floats, Floats]:
    """Return a shear's angle and direction, a point in the plane, and the plane's normal.

    Raise ValueError if it is not a shear.
    """
    import numpy

    m = numpy.asarray(matrix, dtype=numpy.float64)
    values, vectors = numpy.linalg.eig(m[:3, :3])
    (found,) = numpy.where(abs(numpy.real(values) - 1.0) < 1e-4)
    if len(found) < 2:
        raise ValueError(f"No two linear independent eigenvectors found {values}")
    in_plane = numpy.real(vectors[:, found]).squeeze().T
    normal = numpy.zeros(3)
    longest = -1.0
    for first, second in ((0, 1), (0, 2), (1, 2)):
        if second >= len(in_plane):
            continue
        crossed = numpy.cross(in_plane[first], in_plane[second])
        length = vector_norm(crossed)
        if length > longest:
            longest, normal = length, crossed
    normal = normal / longest

    direction = numpy.dot(m[:3, :3] - numpy.identity(3), normal)
    slope = vector_norm(direction)
    point = _eigenvector(m, 1.0, "no eigenvector corresponding to eigenvalue 1")
    return math.atan(slope), direction / slope, point / point[3], normal


def _eigenvector(matrix: Floats, value: float, missing: str, *, last: bool = True) -> Floats:
    """Return the real part of the last (or first) eigenvector for an eigenvalue.

    Raise ValueError(missing) if it does not exist.
    """
    import numpy

    values, vectors = numpy.linalg.eig(matrix)
    (found,) = numpy.where(abs(numpy.real(values) - value) < _NEAR)
    if not len(found):
        raise ValueError(missing)
    return numpy.real(vectors[:, found[-1 if last else 0]]).squeeze()
