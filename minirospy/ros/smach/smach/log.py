"""smach's log functions. They print to stdout until ``set_loggers`` replaces them."""

from __future__ import annotations

from collections.abc import Callable

__all__ = ["logdebug", "logerr", "loginfo", "logwarn", "set_loggers"]

Logger = Callable[[str], object]

_loggers: dict[str, Logger] = {
    "info": lambda text: print(f"[  INFO ] : {text}"),
    "warn": lambda text: print(f"[  WARN ] : {text}"),
    "debug": lambda text: print(f"[ DEBUG ] : {text}"),
    "error": lambda text: print(f"[ ERROR ] : {text}"),
}


def set_loggers(info: Logger, warn: Logger, debug: Logger, error: Logger) -> None:
    """Replace smach's log functions for the whole process. Each function receives one string."""
    _loggers.update(info=info, warn=warn, debug=debug, error=error)


def loginfo(msg: object) -> None:
    """Log a message about the execution of a container."""
    _loggers["info"](str(msg))


def logwarn(msg: object) -> None:
    """Log a warning."""
    _loggers["warn"](str(msg))


def logdebug(msg: object) -> None:
    """Log a debug message."""
    _loggers["debug"](str(msg))


def logerr(msg: object) -> None:
    """Log an error."""
    _loggers["error"](str(msg))
