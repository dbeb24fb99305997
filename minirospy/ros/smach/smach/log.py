"""Where smach logs: lines on standard output, until ``set_loggers`` gives it other functions."""

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
    """Log by these functions of one text each, in the whole process."""
    _loggers.update(info=info, warn=warn, debug=debug, error=error)


def loginfo(msg: object) -> None:
    """Log what the machine does."""
    _loggers["info"](str(msg))


def logwarn(msg: object) -> None:
    """Log what is probably not meant."""
    _loggers["warn"](str(msg))


def logdebug(msg: object) -> None:
    """Log a detail."""
    _loggers["debug"](str(msg))


def logerr(msg: object) -> None:
    """Log what is wrong."""
    _loggers["error"](str(msg))
