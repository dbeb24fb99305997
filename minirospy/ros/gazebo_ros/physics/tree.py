"""The order in which a model's links become MuJoCo's body tree."""

from __future__ import annotations

from dataclasses import dataclass, field

from minirospy.core.sdf.model import Joint, Model
from minirospy.ros.gazebo_ros.physics.library import SimulationError

__all__ = ["LinkTree", "plan_tree"]

WORLD = "world"


@dataclass
class LinkTree:
    """A model's bodies, parents before children.

    ``joint_of``: the joint that connects a link to its parent in the tree; a link without one moves freely. ``loops``: the joints
    that close kinematic loops.
    """

    order: list[str] = field(default_factory=list)
    joint_of: dict[str, Joint] = field(default_factory=dict)
    loops: list[Joint] = field(default_factory=list)


def plan_tree(model: Model) -> LinkTree:
    """Return the tree of a model's links. Raise SimulationError if a joint refers to a missing link."""
    tree = LinkTree()
    for joint in model.joints.values():
        for link in (joint.parent, joint.child):
            if link not in model.links and not (link == WORLD and link == joint.parent):
                raise SimulationError(f"joint '{joint.name}' names no link '{link}'")
        if joint.child in tree.joint_of or _is_above(tree, joint.child, joint.parent):
            tree.loops.append(joint)
        else:
            tree.joint_of[joint.child] = joint

    children: dict[str, list[str]] = {}
    for name in model.links:
        joint_to_parent = tree.joint_of.get(name)
        parent = joint_to_parent.parent if joint_to_parent else WORLD
        children.setdefault(parent, []).append(name)
    waiting = children.pop(WORLD, [])[::-1]
    while waiting:
        name = waiting.pop()
        tree.order.append(name)
        waiting.extend(children.get(name, ())[::-1])
    return tree


def _is_above(tree: LinkTree, link: str, other: str) -> bool:
    """Return whether ``link`` is ``other`` or one of its ancestors."""
    while other != link:
        joint = tree.joint_of.get(other)
        if joint is None:
            return False
        other = joint.parent
    return True
