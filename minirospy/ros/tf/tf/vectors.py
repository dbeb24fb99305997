"""Functions for vectors and quaternions [x, y, z, w] as numpy arrays. Each function imports numpy when it is called."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, overload

from minirospy.ros.tf.tf.euler import EPSILON, rotation_rows

if TYPE_CHECKING:
    import numpy
    from numpy.typing import ArrayLike, NDArray

__all__ = [
    "quaternion_about_axis",
    "quaternion_conjugate",
    "quaternion_from_matrix",
    "quaternion_inverse",
    "quaternion_matrix",
    "quaternion_multiply",
    "quaternion_slerp",
    "random_quaternion",
    "random_rotation_matrix",
    "random_vector",
    "unit_vector",
    "vector_norm",
]


def vector_norm(data: ArrayLike, axis: int | None = None, out: NDArray[numpy.float64] | None = None) -> Any:
    """Return a vector's length, or the lengths along ``axis``. If ``out`` is given, store the result in it and return None."""
    import numpy

    squared = numpy.square(numpy.asarray(data, dtype=numpy.float64))
    if out is None:
        return (
            math.sqrt(squared.sum())
            if squared.ndim == 1
            else numpy.atleast_1d(numpy.sqrt(squared.sum(axis=axis)))
        )
    numpy.sqrt(squared.sum(axis=axis), out)
    return None


@overload
def unit_vector(data: ArrayLike, axis: int | None = None, out: None = None) -> NDArray[numpy.float64]: ...
@overload
def unit_vector(data: ArrayLike, axis: int | None = None, *, out: NDArray[numpy.float64]) -> None: ...
@overload
def unit_vector(data: ArrayLike, axis: int | None, out: NDArray[numpy.float64]) -> None: ...


def unit_vector(
    data: ArrayLike, axis: int | None = None, out: NDArray[numpy.float64] | None = None
) -> NDArray[numpy.float64] | None:
    """Return the vectors scaled to length 1. If ``out`` is given, store the result in it and return None."""
    import numpy

    vectors = numpy.array(data, dtype=numpy.float64)
    if out is None and vectors.ndim == 1:
        unit: NDArray[numpy.float64] = vectors / math.sqrt(numpy.dot(vectors, vectors))
        return unit
    length = numpy.atleast_1d(numpy.sqrt(numpy.square(vectors).sum(axis)))
    if axis is not None:
        length = numpy.expand_dims(length, axis)
    if out is None:
        units: NDArray[numpy.float64] = vectors / length
        return units
    numpy.divide(vectors, length, out)
    return None


def random_vector(size: int | Sequence[int]) -> NDArray[numpy.float64]:
    """Return an array of the given shape that contains random numbers in [0, 1)."""
    import numpy

    numbers: NDArray[numpy.float64] = numpy.random.random(size)
    return numbers


def quaternion_about_axis(angle: float, axis: ArrayLike) -> NDArray[numpy.float64]:
    """Return the quaternion for a rotation by ``angle`` radians about an axis, which need not be normalized."""
    import numpy

    quaternion = numpy.zeros(4)
    quaternion[:3] = numpy.asarray(axis)[:3]
    length = vector_norm(quaternion)
    if length > EPSILON:
        quaternion *= math.sin(angle / 2.0) / length
    quaternion[3] = math.cos(angle / 2.0)
    return quaternion


def quaternion_matrix(quaternion: ArrayLike) -> NDArray[numpy.float64]:
    """Return the 4x4 rotation matrix for a quaternion, which need not be normalized."""
    import numpy

    matrix = numpy.identity(4)
    matrix[:3, :3] = rotation_rows(numpy.asarray(quaternion, dtype=numpy.float64)[:4].tolist())
    return matrix


def quaternion_from_matrix(matrix: ArrayLike) -> NDArray[numpy.float64]:
    """Return the quaternion for a 4x4 rotation matrix."""
    import numpy

    m = numpy.asarray(matrix, dtype=numpy.float64)[:4, :4]
    quaternion = numpy.empty(4)
    trace = numpy.trace(m)
    if trace > m[3, 3]:
        scale = trace
        quaternion[:] = m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], trace
    else:
        i = 1 if m[1, 1] > m[0, 0] else 0
        i = 2 if m[2, 2] > m[i, i] else i
        j, k = (i + 1) % 3, (i + 2) % 3
        scale = m[i, i] - (m[j, j] + m[k, k]) + m[3, 3]
        quaternion[i] = scale
        quaternion[j] = m[i, j] + m[j, i]
        quaternion[k] = m[k, i] + m[i, k]
        quaternion[3] = m[k, j] - m[j, k]
    quaternion *= 0.5 / math.sqrt(scale * m[3, 3])
    return quaternion


def quaternion_multiply(quaternion1: ArrayLike, quaternion0: ArrayLike) -> NDArray[numpy.float64]:
    """Return the product of two quaternions: a rotation by ``quaternion0``, followed by ``quaternion1``."""
    import numpy

    x0, y0, z0, w0 = numpy.asarray(quaternion0).tolist()
    x1, y1, z1, w1 = numpy.asarray(quaternion1).tolist()
    return numpy.array(
        (
            w1 * x0 + x1 * w0 + y1 * z0 - z1 * y0,
            w1 * y0 + y1 * w0 + z1 * x0 - x1 * z0,
            w1 * z0 + z1 * w0 + x1 * y0 - y1 * x0,
            w1 * w0 - x1 * x0 - y1 * y0 - z1 * z0,
        ),
        dtype=numpy.float64,
    )


def quaternion_conjugate(quaternion: ArrayLike) -> NDArray[numpy.float64]:
    """Return the conjugate of a quaternion."""
    import numpy

    x, y, z, w = numpy.asarray(quaternion).tolist()
    return numpy.array((-x, -y, -z, w), dtype=numpy.float64)


def quaternion_inverse(quaternion: ArrayLike) -> NDArray[numpy.float64]:
    """Return the multiplicative inverse of a quaternion."""
    import numpy

    inverse: NDArray[numpy.float64] = quaternion_conjugate(quaternion) / numpy.dot(quaternion, quaternion)
    return inverse


def quaternion_slerp(
    quat0: ArrayLike, quat1: ArrayLike, fraction: float, spin: float = 0, shortestpath: bool = True
) -> NDArray[numpy.float64]:
    """Return the quaternion at ``fraction`` between ``quat0`` and ``quat1``, with ``spin`` additional half turns."""
    import numpy

    q0: NDArray[numpy.float64] = unit_vector(numpy.asarray(quat0)[:4])
    q1: NDArray[numpy.float64] = unit_vector(numpy.asarray(quat1)[:4])
    if fraction == 0.0:
        return q0
    if fraction == 1.0:
        return q1
    dot = float(numpy.dot(q0, q1))
    if abs(abs(dot) - 1.0) < EPSILON:
        return q0
    if shortestpath and dot < 0.0:
        dot, q1 = -dot, -q1
    angle = math.acos(dot) + spin * math.pi
    if abs(angle) < EPSILON:
        return q0
    scale = 1.0 / math.sin(angle)
    return q0 * (math.sin((1.0 - fraction) * angle) * scale) + q1 * (math.sin(fraction * angle) * scale)


def random_quaternion(rand: ArrayLike | None = None) -> NDArray[numpy.float64]:
    """Return a uniformly distributed random unit quaternion, computed from ``rand`` (three numbers in [0, 1]) if given."""
    import numpy

    numbers = numpy.random.rand(3) if rand is None else numpy.asarray(rand)
    assert len(numbers) == 3
    r1, r2 = math.sqrt(1.0 - numbers[0]), math.sqrt(numbers[0])
    t1, t2 = 2.0 * math.pi * numbers[1], 2.0 * math.pi * numbers[2]
    return numpy.array((math.sin(t1) * r1, math.cos(t1) * r1, math.sin(t2) * r2, math.cos(t2) * r2))


def random_rotation_matrix(rand: ArrayLike | None = None) -> NDArray[numpy.float64]:
    """Return the 4x4 matrix of a random rotation."""
    return quaternion_matrix(random_quaternion(rand))
