"""tf.transformations: homogeneous matrices, Euler angles and quaternions [x, y, z, w].

The functions have the names, arguments and meanings of
http://docs.ros.org/en/noetic/api/tf/html/python/transformations.html. The first function that returns an array imports numpy.
"""

from __future__ import annotations

from minirospy.ros.tf.tf.composed import (
    Arcball,
    arcball_constrain_to_axis,
    arcball_map_to_sphere,
    arcball_nearest_axis,
    compose_matrix,
    concatenate_matrices,
    decompose_matrix,
    inverse_matrix,
    is_same_transform,
    orthogonalization_matrix,
    superimposition_matrix,
)
from minirospy.ros.tf.tf.euler import AXES_TO_TUPLE as _AXES2TUPLE
from minirospy.ros.tf.tf.euler import EPSILON as _EPS
from minirospy.ros.tf.tf.euler import NEXT_AXIS as _NEXT_AXIS
from minirospy.ros.tf.tf.euler import TUPLE_TO_AXES as _TUPLE2AXES
from minirospy.ros.tf.tf.euler import (
    euler_from_matrix,
    euler_from_quaternion,
    euler_matrix,
    quaternion_from_euler,
)
from minirospy.ros.tf.tf.matrices import (
    clip_matrix,
    identity_matrix,
    projection_from_matrix,
    projection_matrix,
    reflection_from_matrix,
    reflection_matrix,
    rotation_from_matrix,
    rotation_matrix,
    scale_from_matrix,
    scale_matrix,
    shear_from_matrix,
    shear_matrix,
    translation_from_matrix,
    translation_matrix,
)
from minirospy.ros.tf.tf.vectors import (
    quaternion_about_axis,
    quaternion_conjugate,
    quaternion_from_matrix,
    quaternion_inverse,
    quaternion_matrix,
    quaternion_multiply,
    quaternion_slerp,
    random_quaternion,
    random_rotation_matrix,
    random_vector,
    unit_vector,
    vector_norm,
)

__all__ = [
    "_AXES2TUPLE",
    "_EPS",
    "_NEXT_AXIS",
    "_TUPLE2AXES",
    "Arcball",
    "arcball_constrain_to_axis",
    "arcball_map_to_sphere",
    "arcball_nearest_axis",
    "clip_matrix",
    "compose_matrix",
    "concatenate_matrices",
    "decompose_matrix",
    "euler_from_matrix",
    "euler_from_quaternion",
    "euler_matrix",
    "identity_matrix",
    "inverse_matrix",
    "is_same_transform",
    "orthogonalization_matrix",
    "projection_from_matrix",
    "projection_matrix",
    "quaternion_about_axis",
    "quaternion_conjugate",
    "quaternion_from_euler",
    "quaternion_from_matrix",
    "quaternion_inverse",
    "quaternion_matrix",
    "quaternion_multiply",
    "quaternion_slerp",
    "random_quaternion",
    "random_rotation_matrix",
    "random_vector",
    "reflection_from_matrix",
    "reflection_matrix",
    "rotation_from_matrix",
    "rotation_matrix",
    "scale_from_matrix",
    "scale_matrix",
    "shear_from_matrix",
    "shear_matrix",
    "superimposition_matrix",
    "translation_from_matrix",
    "translation_matrix",
    "unit_vector",
    "vector_norm",
]
