"""ros_numpy.geometry: converts points, vectors and quaternions to arrays and back, and poses and transforms to 4x4 matrices.

An array with more dimensions is converted to an array of messages.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias, TypeVar

import numpy as np
from geometry_msgs.msg import Point, Pose, Quaternion, Transform, Vector3
from numpy.typing import NDArray

from minirospy.ros.ros_numpy.ros_numpy.registry import converts_from_numpy, converts_to_numpy
from minirospy.ros.tf.tf import transformations

if TYPE_CHECKING:
    from minirospy.ros.ros_numpy.ros_numpy.registry import Array

__all__ = [
    "numpy_to_point",
    "numpy_to_pose",
    "numpy_to_quat",
    "numpy_to_transform",
    "numpy_to_vector3",
    "point_to_numpy",
    "pose_to_numpy",
    "quat_to_numpy",
    "transform_to_numpy",
    "vector3_to_numpy",
]

Floats: TypeAlias = NDArray[np.float64]  # vectors, quaternions and matrices
_P = TypeVar("_P", Point, Vector3)


@converts_to_numpy(Vector3)
def vector3_to_numpy(msg: Vector3, hom: bool = False) -> Floats:
    """Return x, y and z, followed by 0 if ``hom``."""
    return np.array([msg.x, msg.y, msg.z, *([0] if hom else [])])


@converts_from_numpy(Vector3)
def numpy_to_vector3(arr: Array) -> object:
    """Return a vector from three values, or from four if the last is 0. Raise AssertionError for other values."""
    if arr.shape[-1] == 4:
        assert np.all(arr[..., -1] == 0)
        arr = arr[..., :-1]
    return _each(arr, 1, lambda row: Vector3(*row.tolist()))


@converts_to_numpy(Point)
def point_to_numpy(msg: Point, hom: bool = False) -> Floats:
    """Return x, y and z, followed by 1 if ``hom``."""
    return np.array([msg.x, msg.y, msg.z, *([1] if hom else [])])


@converts_from_numpy(Point)
def numpy_to_point(arr: Array) -> object:
    """Return a point from three values or four homogeneous coordinates."""
    if arr.shape[-1] == 4:
        arr = arr[..., :-1] / arr[..., -1:]
    return _each(arr, 1, lambda row: Point(*row.tolist()))


@converts_to_numpy(Quaternion)
def quat_to_numpy(msg: Quaternion) -> Floats:
    """Return x, y, z, w."""
    return np.array([msg.x, msg.y, msg.z, msg.w])


@converts_from_numpy(Quaternion)
def numpy_to_quat(arr: Array) -> object:
    """Return a quaternion from x, y, z, w. Raise AssertionError if there are not four values."""
    assert arr.shape[-1] == 4
    return _each(arr, 1, lambda row: Quaternion(*row.tolist()))


@converts_to_numpy(Transform)
def transform_to_numpy(msg: Transform) -> Floats:
    """Return a transform's 4x4 matrix."""
    return _matrix(vector3_to_numpy(msg.translation), quat_to_numpy(msg.rotation))


@converts_from_numpy(Transform)
def numpy_to_transform(arr: Array) -> object:
    """Return a transform from a 4x4 matrix. Raise AssertionError if the matrix has another shape."""
    assert arr.shape[-2:] == (4, 4)
    return _each(arr, 2, lambda matrix: Transform(*_parts(matrix, Vector3)))


@converts_to_numpy(Pose)
def pose_to_numpy(msg: Pose) -> Floats:
    """Return a pose's 4x4 matrix."""
    return _matrix(point_to_numpy(msg.position), quat_to_numpy(msg.orientation))


@converts_from_numpy(Pose)
def numpy_to_pose(arr: Array) -> object:
    """Return a pose from a 4x4 matrix. Raise AssertionError if the matrix has another shape."""
    assert arr.shape[-2:] == (4, 4)
    return _each(arr, 2, lambda matrix: Pose(*_parts(matrix, Point)))


def _matrix(translation: Floats, rotation: Floats) -> Floats:
    matrix: Floats = np.array(transformations.quaternion_matrix(rotation))
    matrix[:3, 3] = translation
    return matrix


def _parts(matrix: Array, position: type[_P]) -> tuple[_P, Quaternion]:
    rotation = np.asarray(transformations.quaternion_from_matrix(matrix))
    return position(*matrix[:3, 3].tolist()), Quaternion(*rotation.tolist())


def _each(arr: Array, dimensions: int, make: Callable[[Array], object]) -> object:
    """Convert an array with ``dimensions`` axes to a message, or one with more axes to an array of messages."""
    if arr.ndim == dimensions:
        return make(arr)
    shape = arr.shape[:-dimensions]
    made = np.empty(shape, dtype=object)
    for index in np.ndindex(shape):
        made[index] = make(arr[index])
    return made
