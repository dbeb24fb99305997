"""Find models, links and joints by the names in requests, and convert states between frames."""

from __future__ import annotations

from typing import TYPE_CHECKING

from minirospy.core.sdf.poses import difference, relative, rotate_back
from minirospy.ros.gazebo_ros.physics import SimJoint, SimLink, SimModel, State

if TYPE_CHECKING:
    from minirospy.ros.gazebo_ros.physics import Simulation

__all__ = [
    "WORLD_FRAMES",
    "find_entity",
    "find_joint",
    "find_link",
    "relative_state",
]

WORLD_FRAMES = ("", "world", "map", "/map")


def find_link(simulation: Simulation, name: str) -> SimLink | None:
    """Return the link ``model::link`` or, as in Gazebo, the first link with that unscoped name; None if there is none."""
    model, _, link = name.partition("::")
    if link:
        found = simulation.models.get(model)
        if found is None:
            return None
        if link not in found.links and link in found.record.lumped:
            link = found.record.lumped[link][0]
        return found.links.get(link)
    return next((each.links[name] for each in simulation.models.values() if name in each.links), None)


def find_entity(simulation: Simulation, name: str) -> SimModel | SimLink | None:
    """Return the model or link that a frame name refers to, or None."""
    return simulation.models.get(name) or find_link(simulation, name)


def find_joint(simulation: Simulation, name: str) -> SimJoint | None:
    """Return the joint named ``model::joint``. Without a model name, search all models in order."""
    model, _, joint = name.rpartition("::")
    if model in simulation.models and joint in simulation.models[model].joints:
        return simulation.models[model].joints[joint]
    return next((each.joints[name] for each in simulation.models.values() if name in each.joints), None)


def relative_state(state: State, frame: State) -> State:
    """Return a state relative to a frame: the relative pose and velocity, in the frame's axes."""
    return State(
        relative(frame.pose, state.pose),
        rotate_back(frame.pose.orientation, difference(state.linear, frame.linear)),
        rotate_back(frame.pose.orientation, difference(state.angular, frame.angular)),
    )
