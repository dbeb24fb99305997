"""The physics of the simulation: a class based on MuJoCo, built from the records of ``minirospy.core.sdf.model``."""

from minirospy.ros.gazebo_ros.physics.handles import SimJoint, SimLink, SimModel
from minirospy.ros.gazebo_ros.physics.library import SimulationError
from minirospy.ros.gazebo_ros.physics.simulation import Simulation
from minirospy.ros.gazebo_ros.physics.states import Contact, LostModel, State, Wrench

__all__ = [
    "Contact",
    "LostModel",
    "SimJoint",
    "SimLink",
    "SimModel",
    "Simulation",
    "SimulationError",
    "State",
    "Wrench",
]
