"""The errors of smach. Each error logs its message when it is created, as in ROS."""

from __future__ import annotations

from minirospy.ros.smach.smach.log import logerr

__all__ = [
    "InvalidConstructionError",
    "InvalidStateError",
    "InvalidTransitionError",
    "InvalidUserCodeError",
    "SmachError",
]


class SmachError(Exception):
    """The base class of smach's errors."""

    def __init__(self, message: str) -> None:
        logerr(f"{type(self).__name__}: {message}")
        super().__init__(message)


class InvalidTransitionError(SmachError):
    """Raised if a transition is for an outcome that its state does not have, or leads to a missing target."""


class InvalidStateError(SmachError):
    """Raised if a state cannot be added, or a container was set up incorrectly."""


class InvalidUserCodeError(SmachError):
    """Raised if a state or callback raised an exception."""


class InvalidConstructionError(SmachError):
    """Raised if ``add`` or a similar function is called while no container is open."""
