"""Call a controller manager's services, and print the results.

Each function waits for its service, and returns whether the call succeeded. Programs import this module rather than
``controller_manager``, which also imports the control loop. Source: http://wiki.ros.org/controller_manager.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from controller_manager_msgs.srv import (
    ListControllers,
    ListControllerTypes,
    LoadController,
    ReloadControllerLibraries,
    SwitchController,
    SwitchControllerRequest,
    UnloadController,
)

from minirospy import client as rospy

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


def list_controller_types() -> None:
    """Print the types of controllers that can be loaded."""
    for kind in _call("list_controller_types", ListControllerTypes).types:
        print(kind)


def reload_libraries(force_kill: bool, restore: bool = False) -> bool:
    """Reload the controllers' modules. ``force_kill``: unload all first. ``restore``: load and start them again."""
    before = _call("list_controllers", ListControllers).controller if restore else []
    print(f"Restore: {restore}")
    is_done = bool(_call("reload_controller_libraries", ReloadControllerLibraries, force_kill).ok)
    print(
        "Successfully reloaded libraries"
        if is_done
        else "Failed to reload libraries. Do you still have controllers loaded?"
    )
    if restore:
        for each in before:
            _call("load_controller", LoadController, each.name)
        running = [each.name for each in before if each.state == "running"]
        _call(
            "switch_controller",
            SwitchController,
            running,
            [],
            SwitchControllerRequest.BEST_EFFORT,
            False,
            0.0,
        )
        print("Controllers restored to original state")
    return is_done


def list_controllers() -> None:
    """Print the loaded controllers with their hardware interfaces and states."""
    controllers = _call("list_controllers", ListControllers).controller
    if not controllers:
        print("No controllers are loaded in mechanism control")
    for each in controllers:
        interfaces = dict.fromkeys(claim.hardware_interface for claim in each.claimed_resources)
        print(f"'{each.name}' - '{'+'.join(interfaces)}' ( {each.state} )")


def load_controller(name: str) -> bool:
    """Load a controller."""
    is_done = bool(_call("load_controller", LoadController, name).ok)
    print(f"Loaded '{name}'" if is_done else f"Error when loading '{name}'")
    return is_done


def unload_controller(name: str) -> bool:
    """Unload a controller, which must be stopped."""
    is_done = bool(_call("unload_controller", UnloadController, name).ok)
    print(f"Unloaded '{name}' successfully" if is_done else f"Error when unloading '{name}'")
    return is_done


def start_controller(name: str) -> bool:
    """Start a controller."""
    return start_stop_controllers(start_controllers=[name])


def start_controllers(names: Sequence[str]) -> bool:
    """Start all these controllers together, or none of them."""
    return start_stop_controllers(start_controllers=names)


def stop_controller(name: str) -> bool:
    """Stop a controller."""
    return start_stop_controllers(stop_controllers=[name])


def stop_controllers(names: Sequence[str]) -> bool:
    """Stop all these controllers together, or none of them."""
    return start_stop_controllers(stop_controllers=names)


def start_stop_controllers(
    start_controllers: Sequence[str] = (), stop_controllers: Sequence[str] = ()
) -> bool:
    """Start and stop controllers in the same control cycle: all of them or none."""
    start, stop = list(start_controllers), list(stop_controllers)
    if not _call(
        "switch_controller", SwitchController, start, stop, SwitchControllerRequest.STRICT, False, 0.0
    ).ok:
        print(f"Error when starting {start} and stopping {stop}")
        return False
    if start:
        print(f"Started {start} successfully")
    if stop:
        print(f"Stopped {stop} successfully")
    return True


def _call(name: str, kind: Any, *arguments: object) -> Any:
    rospy.wait_for_service(f"controller_manager/{name}")
    return rospy.ServiceProxy(f"controller_manager/{name}", kind)(*arguments)
