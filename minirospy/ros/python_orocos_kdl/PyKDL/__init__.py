"""PyKDL: the geometry types used with tf; chains and solvers raise NotImplementedError. Source: http://wiki.ros.org/kdl."""

from __future__ import annotations

from minirospy.ros.python_orocos_kdl.PyKDL.frames import Frame, Rotation
from minirospy.ros.python_orocos_kdl.PyKDL.functions import Equal, SetToZero, addDelta, diff, dot, refusal
from minirospy.ros.python_orocos_kdl.PyKDL.vectors import Twist, Vector, Wrench

Add = refusal("Add")
Chain = refusal("Chain")
ChainDynParam = refusal("ChainDynParam")
ChainFkSolverPos = refusal("ChainFkSolverPos")
ChainFkSolverPos_recursive = refusal("ChainFkSolverPos_recursive")
ChainFkSolverVel = refusal("ChainFkSolverVel")
ChainFkSolverVel_recursive = refusal("ChainFkSolverVel_recursive")
ChainIdSolver = refusal("ChainIdSolver")
ChainIdSolver_RNE = refusal("ChainIdSolver_RNE")
ChainIkSolverPos = refusal("ChainIkSolverPos")
ChainIkSolverPos_LMA = refusal("ChainIkSolverPos_LMA")
ChainIkSolverPos_NR = refusal("ChainIkSolverPos_NR")
ChainIkSolverPos_NR_JL = refusal("ChainIkSolverPos_NR_JL")
ChainIkSolverVel = refusal("ChainIkSolverVel")
ChainIkSolverVel_pinv = refusal("ChainIkSolverVel_pinv")
ChainIkSolverVel_pinv_givens = refusal("ChainIkSolverVel_pinv_givens")
ChainIkSolverVel_pinv_nso = refusal("ChainIkSolverVel_pinv_nso")
ChainIkSolverVel_wdls = refusal("ChainIkSolverVel_wdls")
ChainJntToJacDotSolver = refusal("ChainJntToJacDotSolver")
ChainJntToJacSolver = refusal("ChainJntToJacSolver")
Divide = refusal("Divide")
FrameVel = refusal("FrameVel")
Jacobian = refusal("Jacobian")
JntArray = refusal("JntArray")
JntArrayVel = refusal("JntArrayVel")
JntSpaceInertiaMatrix = refusal("JntSpaceInertiaMatrix")
Joint = refusal("Joint")
Multiply = refusal("Multiply")
MultiplyJacobian = refusal("MultiplyJacobian")
RigidBodyInertia = refusal("RigidBodyInertia")
RotationVel = refusal("RotationVel")
RotationalInertia = refusal("RotationalInertia")
Segment = refusal("Segment")
SolverI = refusal("SolverI")
Subtract = refusal("Subtract")
Tree = refusal("Tree")
TwistVel = refusal("TwistVel")
VectorVel = refusal("VectorVel")
changeBase = refusal("changeBase")
changeRefPoint = refusal("changeRefPoint")
doubleVel = refusal("doubleVel")

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
]
