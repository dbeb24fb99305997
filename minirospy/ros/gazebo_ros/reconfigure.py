"""Dynamic reconfigure of the physics, with gazebo_ros's fifteen parameters. Source: http://wiki.ros.org/gazebo_ros."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

from minirospy import client as rospy
from minirospy.ros.dynamic_reconfigure.definition import Definition
from minirospy.ros.dynamic_reconfigure.dynamic_reconfigure import ConfigType
from minirospy.ros.dynamic_reconfigure.dynamic_reconfigure.server import Server as ReconfigureServer
from minirospy.ros.gazebo_ros.physics import SimulationError

if TYPE_CHECKING:
    from minirospy.ros.gazebo_ros.physics_services import PhysicsServices
    from minirospy.ros.gazebo_ros.server import Server

__all__ = ["PhysicsReconfigure"]

_NO_EFFECT = "No effect: a parameter of Gazebo's engine ODE."
_ODE = (
    ("auto_disable_bodies", "bool", False, None, None),
    ("sor_pgs_precon_iters", "int", 0, 0, 10000),
    ("sor_pgs_iters", "int", 20, 0, 10000),
    ("sor_pgs_w", "double", 1.3, 0.0, 5.0),
    ("sor_pgs_rms_error_tol", "double", -1.0, -1.0, 10000.0),
    ("cfm", "double", 0.0, 0.0, 10.0),
    ("erp", "double", 0.2, 0.0, 10.0),
    ("contact_surface_layer", "double", 0.001, 0.0, 10.0),
    ("contact_max_correcting_vel", "double", 100.0, 0.0, 10000000.0),
    ("max_contacts", "int", 100, 0, 10000000),
)


class PhysicsReconfigure:
    """Serves /gazebo/set_parameters, parameter_descriptions and parameter_updates."""

    def __init__(self, server: Server, services: PhysicsServices) -> None:
        self._server = server
        self._services = services
        self._is_started = False
        self._reconfigure = ReconfigureServer(cast(ConfigType, _definition()), self._on_change)

    def _on_change(self, config: Any, _level: int) -> Any:
        loop = self._server.loop
        ode = self._services.ode
        names = [name for name, *_ in _ODE if hasattr(ode, name)]
        if not self._is_started:
            self._is_started = True
            physics = loop.simulation.physics
            config["time_step"] = physics.step
            config["max_update_rate"] = loop.update_rate
            config["gravity_x"], config["gravity_y"], config["gravity_z"] = physics.gravity
            for name in names:
                config[name] = getattr(ode, name)
            return config
        gravity = (config["gravity_x"], config["gravity_y"], config["gravity_z"])
        try:
            loop.call(
                lambda: self._server.set_physics(config["time_step"], config["max_update_rate"], gravity)
            )
        except SimulationError as error:
            rospy.logerr("%s", error)
        for name in names:
            setattr(ode, name, config[name])
        rospy.loginfo("physics dynamics reconfigure update complete")
        return config


def _definition() -> Definition:
    definition = Definition()
    definition.add("time_step", "double", 1, "Simulated time of a step, in seconds.", 0.001, 0.0, 10.0)
    text = "Steps per second of wall time; 0: as many as possible."
    definition.add("max_update_rate", "double", 1, text, 60.0, 0.0, 1000.0)
    for axis, value in (("x", 0.0), ("y", 0.0), ("z", -9.8)):
        text = f"Gravity along {axis}, in m/s^2."
        definition.add(f"gravity_{axis}", "double", 1, text, value, -100.0, 100.0)
    for name, kind, default, least, greatest in _ODE:
        definition.add(name, kind, 1, _NO_EFFECT, default, least, greatest)
    return definition
