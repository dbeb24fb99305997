"""Converts joint positions to link poses. Pure.

Source: http://wiki.ros.org/robot_state_publisher.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from minirospy.core.urdf.model import JointType, Robot
from minirospy.core.urdf.poses import Pose, Segment

__all__ = ["LinkPose", "RobotFrames", "prefixed"]


class LinkPose(NamedTuple):
    """The pose of frame ``child`` relative to frame ``parent``."""

    parent: str
    child: str
    pose: Pose


class RobotFrames:
    """A robot's moving and fixed frames, both ordered by joint name.

    Planar joints are treated as fixed, as in KDL. Floating joints have no frame, because a JointState cannot contain
    their pose.
    """

    def __init__(self, robot: Robot) -> None:
        segments = {
            joint.name: Segment(joint)
            for name in sorted(robot.joints)
            if (joint := robot.joints[name]).type is not JointType.FLOATING
            and robot.parent_joint(joint.child) is joint
        }
        self._moving = {name: segment for name, segment in segments.items() if segment.is_moving}
        self._fixed = [segment for segment in segments.values() if not segment.is_moving]
        self._mimics = {name: joint.mimic for name, joint in sorted(robot.joints.items()) if joint.mimic}
        self._names = robot.joints.keys()

    def fixed(self) -> Iterator[LinkPose]:
        """Yield the poses of links attached by fixed joints."""
        return (LinkPose(each.joint.parent, each.joint.child, each.pose()) for each in self._fixed)

    def moving(self, positions: Mapping[str, float]) -> Iterator[LinkPose]:
        """Yield the poses of the links whose joint has a position in the message, or mimics a joint that has one."""
        known = {
            name: position if math.isfinite(position) else math.nan for name, position in positions.items()
        }
        # Repeat, because a joint may mimic another mimic joint.
        waiting = {name: mimic for name, mimic in self._mimics.items() if name not in known}
        while found := [name for name, mimic in waiting.items() if mimic.joint in known]:
            for name in found:
                mimic = waiting.pop(name)
                known[name] = known[mimic.joint] * mimic.multiplier + mimic.offset
        for name in sorted(known.keys() & self._moving.keys()):
            segment = self._moving[name]
            yield LinkPose(segment.joint.parent, segment.joint.child, segment.pose(known[name]))

    def unknown(self, names: Mapping[str, float]) -> list[str]:
        """Return the names that are not joints of the robot, sorted."""
        return sorted(names.keys() - self._names)


def prefixed(prefix: str, frame: str) -> str:
    """Add the tf_prefix to a frame's name; if the name starts with a slash, only remove the slash."""
    if frame.startswith("/"):
        return frame[1:]
    return f"{prefix.removeprefix('/')}/{frame}" if prefix else frame
