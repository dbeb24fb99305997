"""Call a controller manager's services, and print the results.

Source: http://wiki.ros.org/controller_manager.
"""

from minirospy.ros.controller_manager.interface import (
    list_controller_types,
    list_controllers,
    load_controller,
    reload_libraries,
    start_controller,
    start_controllers,
    start_stop_controllers,
    stop_controller,
    stop_controllers,
    unload_controller,
)

__all__ = [
    "list_controller_types",
    "list_controllers",
    "load_controller",
    "reload_libraries",
    "start_controller",
    "start_controllers",
    "start_stop_controllers",
    "stop_controller",
    "stop_controllers",
    "unload_controller",
]
