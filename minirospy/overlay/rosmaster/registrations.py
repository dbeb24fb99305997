"""rosmaster.registrations, provided by minirospy: tables of what nodes have registered."""

from minirospy.ros.rosmaster.rosmaster.registrations import (
    NodeRef,
    RegistrationManager,
    Registrations,
    shutdown_node_task,
)

__all__ = ["NodeRef", "RegistrationManager", "Registrations", "shutdown_node_task"]
