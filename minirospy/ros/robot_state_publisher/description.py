"""Reads the parameter robot_description, searching namespaces in the same order as ROS's nodes."""

from __future__ import annotations

from minirospy import client as rospy
from minirospy.base.errors import MinirospyError, UrdfError
from minirospy.core.urdf.model import Robot
from minirospy.core.urdf.read import parse_robot

__all__ = ["DescriptionError", "robot_of_parameter"]

NAME = "robot_description"


class DescriptionError(MinirospyError):
    """Raised if the parameter does not contain a valid robot. ``lines`` are the messages that ROS's parser prints."""

    def __init__(self, *lines: str) -> None:
        super().__init__(*lines)
        self.lines = lines

    def __str__(self) -> str:
        return "; ".join(self.lines)


def robot_of_parameter(name: str = NAME) -> Robot:
    """Build the robot from a parameter's description, searching from the node's namespace upwards.

    Raise DescriptionError if the parameter is not set, or the description is invalid.
    """
    key = rospy.resolve_name(name)
    if not rospy.has_param(key):
        found = rospy.search_param(name)
        if found is None:
            raise DescriptionError(f"Could not find parameter {name} on parameter server")
        key = found
    text = rospy.get_param(key, None)
    if not isinstance(text, str):
        raise DescriptionError(f"Could not read parameter {key} on parameter server")
    try:
        return parse_robot(text, key)
    except UrdfError as error:
        place = f" ({error.file}:{error.line})" if error.line else f" ({error.file})"
        raise DescriptionError(error.trail[0] + place, *error.trail[1:]) from error
