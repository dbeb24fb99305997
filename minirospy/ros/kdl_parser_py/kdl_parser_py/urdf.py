"""The functions of kdl_parser_py.urdf: each returns (whether it went well, the tree). Source: http://wiki.ros.org/kdl_parser_py."""

from __future__ import annotations

from typing import Protocol

from minirospy.core.urdf.read import parse_robot, read_robot
from minirospy.ros.kdl_parser_py.kdl_parser_py.tree import Tree, tree_of

__all__ = ["treeFromFile", "treeFromParam", "treeFromString", "treeFromUrdfModel"]


class Writable(Protocol):
    """A robot that can be written, such as urdf_parser_py's."""

    def to_xml_string(self) -> str:
        """Return the description."""


def treeFromFile(filename: str) -> tuple[bool, Tree]:
    """Return the tree of a file. Raise UrdfError, OSError."""
    return True, tree_of(read_robot(filename))


def treeFromParam(param: str) -> tuple[bool, Tree]:
    """Return the tree of a parameter. Raise KeyError if it is not set, UrdfError."""
    from minirospy import client as rospy

    return True, tree_of(parse_robot(rospy.get_param(param), param))


def treeFromString(xml: str | bytes) -> tuple[bool, Tree]:
    """Return the tree of a description. Raise UrdfError."""
    return True, tree_of(parse_robot(xml))


def treeFromUrdfModel(robot_model: Writable, quiet: bool = False) -> tuple[bool, Tree]:
    """Return the tree of urdf_parser_py's robot; a root with an inertia is warned of unless ``quiet``. Raise UrdfError."""
    robot = parse_robot(robot_model.to_xml_string())
    if robot.links[robot.root].inertial and not quiet:
        print(
            f"The root link {robot.root} has an inertia specified in the URDF, but KDL does not support a root link with an "
            "inertia.  As a workaround, you can add an extra dummy link to your URDF."
        )
    return True, tree_of(robot)
