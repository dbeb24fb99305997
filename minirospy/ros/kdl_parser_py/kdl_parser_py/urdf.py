"""The functions of kdl_parser_py.urdf: each returns (success, tree). Source: http://wiki.ros.org/kdl_parser_py."""

from __future__ import annotations

from typing import Protocol

from minirospy.core.urdf.read import parse_robot, read_robot
from minirospy.ros.kdl_parser_py.kdl_parser_py.tree import Tree, tree_of

__all__ = ["treeFromFile", "treeFromParam", "treeFromString", "treeFromUrdfModel"]


class Writable(Protocol):
    """A robot model that can be serialized to XML, such as urdf_parser_py's."""

    def to_xml_string(self) -> str:
        """Return the description as XML."""


def treeFromFile(filename: str) -> tuple[bool, Tree]:
    """Build the tree from a description file.

    Raise UrdfError if the description is invalid, OSError if the file cannot be read.
    """
    return True, tree_of(read_robot(filename))


def treeFromParam(param: str) -> tuple[bool, Tree]:
    """Build the tree from the robot description in a ROS parameter.

    Raise KeyError if the parameter is not set, UrdfError if the description is invalid.
    """
    from minirospy import client as rospy

    return True, tree_of(parse_robot(rospy.get_param(param), param))


def treeFromString(xml: str | bytes) -> tuple[bool, Tree]:
    """Build the tree from a robot description in XML. Raise UrdfError if the description is invalid."""
    return True, tree_of(parse_robot(xml))


def treeFromUrdfModel(robot_model: Writable, quiet: bool = False) -> tuple[bool, Tree]:
    """Build the tree from urdf_parser_py's robot; warn if the root has an inertia, unless ``quiet``.

    Raise UrdfError if the description is invalid.
    """
    robot = parse_robot(robot_model.to_xml_string())
    if robot.links[robot.root].inertial and not quiet:
        print(
            f"The root link {robot.root} has an inertia specified in the URDF, but KDL does not support a root link with an "
            "inertia.  As a workaround, you can add an extra dummy link to your URDF."
        )
    return True, tree_of(robot)
