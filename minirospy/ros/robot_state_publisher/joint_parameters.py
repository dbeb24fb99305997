"""Parameters for joint_state_publisher, shared by its terminal and web versions. Pure: parameter values are arguments.

Source: http://wiki.ros.org/joint_state_publisher.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

from minirospy.ros.robot_state_publisher.joints import Dependent, JointError, JointOptions

__all__ = ["NAMES", "JointParameters", "read_parameters"]

NAMES = (
    "robot_description", "rate", "dependent_joints", "use_mimic_tags", "use_smallest_joint_limits", "source_list", "zeros",
    "delta", "publish_default_positions", "publish_default_velocities", "publish_default_efforts",
)  # fmt: skip
"""The parameters to read. A private one takes precedence over one in the node's namespace; for zeros, both are read."""


class JointParameters(NamedTuple):
    """The node's parameters, parsed and checked.

    ``rate`` is in messages per second, ``delta`` in radians or metres per message; ``sources`` are topics.
    """

    description: str
    options: JointOptions
    rate: float
    delta: float
    sources: list[str]


def read_parameters(param: Callable[[str, object], object], zeros: Sequence[object]) -> JointParameters:
    """Read the parameters with ``param(name, default)``. ``zeros``: the values of ~zeros and zeros.

    Raise JointError if a parameter is invalid.
    """
    description = param("robot_description", None)
    if not isinstance(description, str):
        raise JointError("The robot_description parameter is required and not set.")
    options = JointOptions(
        dependent_joints=_dependent_joints(param("dependent_joints", {})),
        use_mimic_tags=bool(param("use_mimic_tags", True)),
        use_smallest_joint_limits=bool(param("use_smallest_joint_limits", True)),
        zero=lambda joint: _zero(zeros, joint),
        publish_default_positions=bool(param("publish_default_positions", True)),
        publish_default_velocities=bool(param("publish_default_velocities", False)),
        publish_default_efforts=bool(param("publish_default_efforts", False)),
    )
    rate = _as_number("rate", param("rate", 10.0))

    if rate <= 0:
        raise JointError(f"The rate parameter is {rate:g}: it is a number of messages a second, above 0")
    sources = param("source_list", [])
    if not isinstance(sources, list):
        raise JointError(f"The source_list parameter is [{sources}]: it is a list of topics")
    delta = _as_number("delta", param("delta", 0.0))
    return JointParameters(description, options, rate, delta, [str(topic) for topic in sources])


def _zero(zeros: Sequence[object], joint: str) -> float | None:
    """Return a joint's zero position from the first of the ``zeros`` dicts that contains the joint.

    Slashes in the joint's name separate tree levels.
    """
    for tree in zeros:
        value: object = tree
        for part in joint.split("/"):
            value = value.get(part) if isinstance(value, dict) else None
        if value is not None:
            return _as_number(f"zeros/{joint}", value)
    return None


def _dependent_joints(value: object) -> dict[str, Dependent]:
    if not isinstance(value, dict):
        raise JointError(
            f"The dependent_joints parameter is [{value}]: it is as {{joint: {{parent: other}}}}"
        )
    found = {}
    for name, rule in value.items():
        if not isinstance(rule, dict) or not isinstance(rule.get("parent"), str):
            raise JointError(f"The dependent_joints parameter has no parent for joint [{name}]")
        factor, offset = (
            _as_number(f"dependent_joints/{name}/{key}", rule.get(key, default))
            for key, default in (("factor", 1.0), ("offset", 0.0))
        )
        found[str(name)] = Dependent(rule["parent"], factor, offset)
    return found


def _as_number(name: str, value: object) -> float:
    if isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value):
        return float(value)
    raise JointError(f"The {name} parameter is [{value}]: it is a number")
