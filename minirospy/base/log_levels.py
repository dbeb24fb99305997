"""Log levels of rosgraph_msgs/Log and of Python's ``logging``, and the levels of this process's loggers.

Source: http://docs.ros.org/api/rosgraph_msgs/html/msg/Log.html, http://wiki.ros.org/rospy/Overview/Logging.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable

__all__ = [
    "DEBUG",
    "ERROR",
    "FATAL",
    "INFO",
    "LEVEL_NAMES",
    "PYTHON_LEVELS",
    "SEVERITIES",
    "WARN",
    "logger_levels",
    "ros_level",
    "set_logger_level",
]

DEBUG, INFO, WARN, ERROR, FATAL = 1, 2, 4, 8, 16

LEVEL_NAMES = {DEBUG: "DEBUG", INFO: "INFO", WARN: "WARN", ERROR: "ERROR", FATAL: "FATAL"}

PYTHON_LEVELS = {
    DEBUG: logging.DEBUG,
    INFO: logging.INFO,
    WARN: logging.WARNING,
    ERROR: logging.ERROR,
    FATAL: logging.CRITICAL,
}


SEVERITIES = {python: LEVEL_NAMES[ros] for ros, python in PYTHON_LEVELS.items()}
"""Dict from Python's level to ROS's name for it."""


def ros_level(python_level: int) -> int:
    """Return the closest ROS level at or below a Python level."""
    return max((ros for ros, python in PYTHON_LEVELS.items() if python <= python_level), default=DEBUG)


def logger_levels(names: Iterable[str]) -> dict[str, str]:
    """Return a dict from logger name to the name of the logger's effective level."""
    return {name: LEVEL_NAMES[ros_level(logging.getLogger(name).getEffectiveLevel())] for name in names}


def set_logger_level(logger: str, level: str) -> None:
    """Set a logger's level by name, in upper or lower case. Raise ValueError if the name is unknown."""
    levels = {name: ros for ros, name in LEVEL_NAMES.items()}
    if level.upper() not in levels:
        raise ValueError(f"[{level}] is not one of the levels {', '.join(levels).lower()}")
    logging.getLogger(logger).setLevel(PYTHON_LEVELS[levels[level.upper()]])
