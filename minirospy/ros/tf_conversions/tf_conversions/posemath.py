"""tf_conversions.posemath: converts PyKDL's frames to and from tf's tuples, Pose messages and 4x4 matrices.

Source: http://wiki.ros.org/tf_conversions.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

from geometry_msgs.msg import Point, Pose, Quaternion

from minirospy.ros.python_orocos_kdl.PyKDL import (
    Add,
    Chain,
    ChainDynParam,
    ChainFkSolverPos,
    ChainFkSolverPos_recursive,
    ChainFkSolverVel,
    ChainFkSolverVel_recursive,
    ChainIdSolver,
    ChainIdSolver_RNE,
    ChainIkSolverPos,
    ChainIkSolverPos_LMA,
    ChainIkSolverPos_NR,
    ChainIkSolverPos_NR_JL,
    ChainIkSolverVel,
    ChainIkSolverVel_pinv,
    ChainIkSolverVel_pinv_givens,
    ChainIkSolverVel_pinv_nso,
    ChainIkSolverVel_wdls,
    ChainJntToJacDotSolver,
    ChainJntToJacSolver,
    Divide,
    Equal,
    Frame,
    FrameVel,
    Jacobian,
    JntArray,
    JntArrayVel,
    JntSpaceInertiaMatrix,
    Joint,
    Multiply,
    MultiplyJacobian,
    RigidBodyInertia,
    Rotation,
    RotationalInertia,
    RotationVel,
    Segment,
    SetToZero,
    SolverI,
    Subtract,
    Tree,
    Twist,
    TwistVel,
    Vector,
    VectorVel,
    Wrench,
    addDelta,
    changeBase,
    changeRefPoint,
    diff,
    dot,
    doubleVel,
)
from minirospy.ros.tf.tf import transformations

if TYPE_CHECKING:
    import numpy
    from numpy.typing import NDArray

    class _OpenCV(Protocol):
        """The interface of OpenCV's old module cv."""

        def Rodrigues2(self, src: NDArray[numpy.floating], dst: NDArray[numpy.floating]) -> object: ...


__all__ = [
    "Add",
    "Chain",
    "ChainDynParam",
    "ChainFkSolverPos",
    "ChainFkSolverPos_recursive",
    "ChainFkSolverVel",
    "ChainFkSolverVel_recursive",
    "ChainIdSolver",
    "ChainIdSolver_RNE",
    "ChainIkSolverPos",
    "ChainIkSolverPos_LMA",
    "ChainIkSolverPos_NR",
    "ChainIkSolverPos_NR_JL",
    "ChainIkSolverVel",
    "ChainIkSolverVel_pinv",
    "ChainIkSolverVel_pinv_givens",
    "ChainIkSolverVel_pinv_nso",
    "ChainIkSolverVel_wdls",
    "ChainJntToJacDotSolver",
    "ChainJntToJacSolver",
    "Divide",
    "Equal",
    "Frame",
    "FrameVel",
    "Jacobian",
    "JntArray",
    "JntArrayVel",
    "JntSpaceInertiaMatrix",
    "Joint",
    "Multiply",
    "MultiplyJacobian",
    "Point",
    "Pose",
    "Quaternion",
    "RigidBodyInertia",
    "Rotation",
    "RotationVel",
    "RotationalInertia",
    "Segment",
    "SetToZero",
    "SolverI",
    "Subtract",
    "Tree",
    "Twist",
    "TwistVel",
    "Vector",
    "VectorVel",
    "Wrench",
    "addDelta",
    "changeBase",
    "changeRefPoint",
    "diff",
    "dot",
    "doubleVel",
    "fromCameraParams",
    "fromMatrix",
    "fromMsg",
    "fromTf",
    "toMatrix",
    "toMsg",
    "toTf",
    "transformations",
]

Tuples = tuple[Sequence[float], Sequence[float]]


def fromTf(tf: Tuples) -> Frame:
    """Convert a result of lookupTransform, the tuples (x, y, z) and (x, y, z, w), to a Frame."""
    (x, y, z), (qx, qy, qz, qw) = tf
    return Frame(Rotation.Quaternion(qx, qy, qz, qw), Vector(x, y, z))


def toTf(f: Frame) -> tuple[tuple[float, float, float], tuple[float, float, float, float]]:
    """Convert a Frame to the tuples (x, y, z) and (x, y, z, w)."""
    return (f.p[0], f.p[1], f.p[2]), f.M.GetQuaternion()


def fromMsg(p: Pose) -> Frame:
    """Convert a Pose to a Frame."""
    position, orientation = p.position, p.orientation
    return fromTf(
        (
            (position.x, position.y, position.z),
            (orientation.x, orientation.y, orientation.z, orientation.w),
        )
    )


def toMsg(f: Frame) -> Pose:
    """Convert a Frame to a Pose."""
    return Pose(Point(f.p[0], f.p[1], f.p[2]), Quaternion(*f.M.GetQuaternion()))


def fromMatrix(m: NDArray[numpy.floating]) -> Frame:
    """Convert a 4x4 matrix to a Frame."""
    rotation = [float(m[row, column]) for row in range(3) for column in range(3)]
    return Frame(Rotation(*rotation), Vector(float(m[0, 3]), float(m[1, 3]), float(m[2, 3])))


def toMatrix(f: Frame) -> NDArray[numpy.float64]:
    """Convert a Frame to a 4x4 matrix."""
    import numpy

    return numpy.array([*([f[row, column] for column in range(4)] for row in range(3)), [0.0, 0.0, 0.0, 1.0]])


def fromCameraParams(cv: _OpenCV, rvec: NDArray[numpy.floating], tvec: NDArray[numpy.floating]) -> Frame:
    """Convert OpenCV's rotation and translation vectors to a Frame; ``cv`` is OpenCV's old module."""
    import numpy

    matrix = numpy.zeros((4, 4), dtype=numpy.float32)
    matrix[:3, 3] = tvec[0, 0], tvec[1, 0], tvec[2, 0]
    matrix[3, 3] = 1.0
    cv.Rodrigues2(rvec, matrix[:3, :3])
    return fromMatrix(matrix)
