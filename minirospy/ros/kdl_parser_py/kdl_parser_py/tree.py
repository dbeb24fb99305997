"""A robot's tree as classes with PyKDL's names: segments, joints, chains and poses, but no solvers.

Source: https://www.orocos.org/kdl, http://wiki.ros.org/kdl_parser.
"""

from __future__ import annotations

from collections.abc import Iterator

from minirospy.core.urdf.model import Joint as UrdfJoint
from minirospy.core.urdf.model import JointType, Robot
from minirospy.core.urdf.poses import Pose
from minirospy.core.urdf.poses import Segment as JointSegment

__all__ = ["Chain", "Joint", "Segment", "Tree", "tree_of"]

_TYPE_NAMES = {
    JointType.REVOLUTE: "RotAxis",
    JointType.CONTINUOUS: "RotAxis",
    JointType.PRISMATIC: "TransAxis",
}


class Joint:
    """A segment's joint, connecting it to its parent."""

    def __init__(self, joint: UrdfJoint) -> None:
        self._joint = joint

    def getName(self) -> str:
        """Return the joint's name."""
        return self._joint.name

    def getTypeName(self) -> str:
        """Return "RotAxis", "TransAxis", or "None" for a fixed joint, as in KDL."""
        return _TYPE_NAMES.get(self._joint.type, "None")


class Segment:
    """A joint and its child link."""

    def __init__(self, joint: UrdfJoint) -> None:
        self._segment = JointSegment(joint)
        self._joint = Joint(joint)

    @property
    def is_moving(self) -> bool:
        """Return whether the segment's joint is movable."""
        return self._segment.is_moving

    @property
    def parent(self) -> str:
        """Return the name of the parent link."""
        return self._segment.joint.parent

    def getName(self) -> str:
        """Return the name of the segment's link."""
        return self._segment.joint.child

    def getJoint(self) -> Joint:
        """Return the joint."""
        return self._joint

    def pose(self, q: float) -> Pose:
        """Return the link's pose relative to its parent: translation, and rotation as (x, y, z, w)."""
        return self._segment.pose(q)


class Chain:
    """The segments from a link to one of its descendants."""

    def __init__(self, segments: list[Segment]) -> None:
        self._segments = segments

    def getNrOfSegments(self) -> int:
        """Return the number of segments."""
        return len(self._segments)

    def getNrOfJoints(self) -> int:
        """Return the number of movable joints."""
        return sum(segment.is_moving for segment in self._segments)

    def getSegment(self, nr: int) -> Segment:
        """Return the segment with this index; 0 is the topmost segment."""
        return self._segments[nr]


class Tree:
    """A robot's tree of segments, without the root link."""

    def __init__(self, root_name: str = "root") -> None:
        self._root = root_name
        self._segments: dict[str, Segment] = {}

    def addSegment(self, segment: Segment, hook_name: str) -> bool:
        """Add a segment below a link; return False if the link does not exist or the segment already exists."""
        name = segment.getName()
        is_known = hook_name == self._root or hook_name in self._segments
        if not is_known or name in self._segments or name == self._root:
            return False
        self._segments[name] = segment
        return True

    def getNrOfSegments(self) -> int:
        """Return the number of segments, excluding the root."""
        return len(self._segments)

    def getNrOfJoints(self) -> int:
        """Return the number of movable joints."""
        return sum(segment.is_moving for segment in self._segments.values())

    def getChain(self, chain_root: str, chain_tip: str) -> Chain:
        """Return the segments from a link to a descendant. Raise ValueError if ``chain_tip`` is not a descendant."""
        found: list[Segment] = []
        link = chain_tip
        while link != chain_root:
            segment = self._segments.get(link)
            if segment is None:
                raise ValueError(f"link [{chain_tip}] is not below link [{chain_root}]")
            found.append(segment)
            link = segment.parent
        return Chain(found[::-1])


def tree_of(robot: Robot) -> Tree:
    """Build a robot's tree, adding each link after its parent."""
    tree = Tree(robot.root)
    for joint in _downwards(robot):
        tree.addSegment(Segment(joint), joint.parent)
    return tree


def _downwards(robot: Robot) -> Iterator[UrdfJoint]:
    waiting, seen = [robot.root], {robot.root}
    while waiting:
        for joint in robot.child_joints(waiting.pop()):
            if joint.child not in seen:
                seen.add(joint.child)
                waiting.append(joint.child)
                yield joint
