"""The controller manager for a node of the user's own: ``from controller_manager import run``.

The names are imported on first use, so that the programs that only call its services start faster.
Source: http://wiki.ros.org/controller_manager.
"""

from typing import TYPE_CHECKING

from minirospy.ros.submodules import import_passed_on

if TYPE_CHECKING:
    from minirospy.ros.controller_manager.loop import ControlLoop, run
    from minirospy.ros.controller_manager.manager import ControllerManager

__all__ = ["ControlLoop", "ControllerManager", "run"]

_PLACES = {
    "ControlLoop": "minirospy.ros.controller_manager.loop:ControlLoop",
    "ControllerManager": "minirospy.ros.controller_manager.manager:ControllerManager",
    "run": "minirospy.ros.controller_manager.loop:run",
}


def __getattr__(name: str) -> object:
    if name in _PLACES:
        return import_passed_on(globals(), name, _PLACES[name])
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
