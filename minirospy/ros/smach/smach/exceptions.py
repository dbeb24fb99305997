"""The errors of smach. Each error logs its text when it is made, as in ROS."""

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
    """The base of the errors of smach."""

    def __init__(self, message: str) -> None:
        logerr(f"{type(self).__name__}: {message}")
        super().__init__(message)


class InvalidTransitionError(SmachError):
    """A state has no such outcome, or it leads nowhere."""


class InvalidStateError(SmachError):
    """A state cannot be added, or a container is not made correctly."""


class InvalidUserCodeError(SmachError):
    """Code of a state, or of a callback, raised an error."""


class InvalidConstructionError(SmachError):
    """A container is used before it is opened."""
