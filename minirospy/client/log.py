"""Log lines: to the terminal, to the node's log file, and to /rosout.

Everything goes through Python's ``logging``, by the logger "rosout" and its children, so that a program
may add handlers of its own. Source: http://wiki.ros.org/rospy/Overview/Logging.
"""

from __future__ import annotations

import logging
import os
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from minirospy.client.process import process

if TYPE_CHECKING:
    from minirospy.client.process import NodeProcess
    from minirospy.client.topics import Publisher

__all__ = [
    "DEBUG",
    "ERROR",
    "FATAL",
    "INFO",
    "WARN",
    "configure",
    "logdebug",
    "logdebug_once",
    "logdebug_throttle",
    "logdebug_throttle_identical",
    "logerr",
    "logerr_once",
    "logerr_throttle",
    "logerr_throttle_identical",
    "logfatal",
    "logfatal_once",
    "logfatal_throttle",
    "logfatal_throttle_identical",
    "loginfo",
    "loginfo_once",
    "loginfo_throttle",
    "loginfo_throttle_identical",
    "logout",
    "logwarn",
    "logwarn_once",
    "logwarn_throttle",
    "logwarn_throttle_identical",
    "set_logger_level",
    "start_rosout",
]

DEBUG, INFO, WARN, ERROR, FATAL = 1, 2, 4, 8, 16
"""The levels of rosgraph_msgs/Log, as ``init_node(log_level=...)`` takes them."""

_PYTHON_LEVEL = {
    DEBUG: logging.DEBUG,
    INFO: logging.INFO,
    WARN: logging.WARNING,
    ERROR: logging.ERROR,
    FATAL: logging.CRITICAL,
}
_LEVEL_NAME = {
    logging.DEBUG: "DEBUG",
    logging.INFO: "INFO",
    logging.WARNING: "WARN",
    logging.ERROR: "ERROR",
    logging.CRITICAL: "FATAL",
}
_ROS_LEVEL = {python: ros for ros, python in _PYTHON_LEVEL.items()}
_COLOUR = {
    logging.DEBUG: "\033[32m",
    logging.WARNING: "\033[33m",
    logging.ERROR: "\033[31m",
    logging.CRITICAL: "\033[31m",
}
_DEFAULT_FORMAT = "[${severity}] [${time}]: ${message}"
_rosout = logging.getLogger("rosout")
_F = TypeVar("_F", bound=Callable[..., None])


class LogFunction(Protocol):
    """``loginfo`` and its kin."""

    def __call__(self, msg: object, *args: object, logger_name: str | None = None, **kwargs: Any) -> None:
        """Log ``msg % args``; ``logger_name`` names a logger below "rosout"."""


class ThrottledLogFunction(Protocol):
    """``loginfo_throttle`` and its kin."""

    def __call__(
        self, period: float, msg: object, *args: object, logger_name: str | None = None, **kwargs: Any
    ) -> None:
        """Log, but from this place in the code at most once in ``period`` seconds."""


def configure(node: NodeProcess, log_level: int | None, log_file: str | None) -> None:
    """Set up the handlers for the node: terminal, log file. ``log_file``: the ``__log:=`` argument."""
    _rosout.setLevel(_PYTHON_LEVEL.get(log_level or INFO, logging.INFO))
    _rosout.addHandler(TerminalHandler(node))
    # Our own library speaks through the same lines, where something is wrong.
    ours = logging.getLogger("minirospy")
    ours.addHandler(TerminalHandler(node))
    ours.setLevel(logging.DEBUG if log_level == DEBUG else logging.WARNING)
    path = Path(log_file) if log_file else node.environment.log_dir / _log_file_name(node.name)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        file = logging.FileHandler(path, encoding="utf-8", delay=True)
    except OSError as error:
        print(f"no log file: {error}", file=sys.stderr)
        return
    file.setFormatter(logging.Formatter("[%(name)s][%(levelname)s] %(asctime)s: %(message)s"))
    _rosout.addHandler(file)
    ours.addHandler(file)


def start_rosout(node: NodeProcess) -> None:
    """Publish log lines to /rosout, and offer the services that list and set logger levels."""
    from roscpp.msg import Logger
    from roscpp.srv import GetLoggers, GetLoggersResponse, SetLoggerLevel, SetLoggerLevelResponse
    from rosgraph_msgs.msg import Log

    from minirospy.client.services import Service
    from minirospy.client.topics import Publisher

    publisher = Publisher("/rosout", Log, latch=True, queue_size=100)
    _rosout.addHandler(RosoutHandler(node, publisher))

    def get_loggers(request: object) -> Any:
        found = [_rosout, *(logging.getLogger(n) for n in logging.root.manager.loggerDict)]
        return GetLoggersResponse(
            [
                Logger(logger.name, _LEVEL_NAME.get(logger.getEffectiveLevel(), "INFO").lower())
                for logger in found
            ]
        )

    def set_level(request: Any) -> Any:
        set_logger_level(request.logger, request.level)
        return SetLoggerLevelResponse()

    Service("~get_loggers", GetLoggers, get_loggers)
    Service("~set_logger_level", SetLoggerLevel, set_level)


def set_logger_level(logger: str, level: str) -> None:
    """Set a logger's level by name (debug, info, warn, error, fatal). Raises ValueError."""
    python_level = {name.lower(): number for number, name in _LEVEL_NAME.items()}.get(level.lower())
    if python_level is None:
        raise ValueError(f"log level [{level}] is not one of debug, info, warn, error, fatal")
    logging.getLogger(logger).setLevel(python_level)


class TerminalHandler(logging.Handler):
    """Lines as rospy prints them: debug and info to stdout, the rest to stderr, coloured on a terminal.

    ROSCONSOLE_FORMAT chooses the form (http://wiki.ros.org/rosconsole#Console_Output_Formatting).
    """

    def __init__(self, node: NodeProcess) -> None:
        super().__init__()
        self._node = node
        self._template = os.environ.get("ROSCONSOLE_FORMAT") or _DEFAULT_FORMAT

    def emit(self, record: logging.LogRecord) -> None:
        """Write one line."""
        try:
            stream = sys.stdout if record.levelno < logging.WARNING else sys.stderr
            line = self._line(record)
            colour = _COLOUR.get(record.levelno)
            if colour and stream.isatty():
                line = f"{colour}{line}\033[0m"
            stream.write(line + "\n")
            stream.flush()
        except (OSError, ValueError):
            # The terminal is gone; the program has better things to do.
            pass

    def _line(self, record: logging.LogRecord) -> str:
        message = record.getMessage()
        if record.exc_info:
            message += "\n" + logging.Formatter().formatException(record.exc_info)
        severity, stamp = _LEVEL_NAME.get(record.levelno, record.levelname), self._stamp(record)
        if self._template == _DEFAULT_FORMAT:
            return f"[{severity}] [{stamp}]: {message}"
        fields = {
            "severity": severity,
            "time": stamp,
            "message": message,
            "walltime": f"{record.created:f}",
            "logger": record.name,
            "thread": str(record.thread),
            "pid": str(record.process),
            "node": self._node.name,
            "file": record.pathname,
            "line": str(record.lineno),
            "function": record.funcName or "",
        }
        line = self._template
        for field, value in fields.items():
            line = line.replace("${" + field + "}", value)
        return line

    def _stamp(self, record: logging.LogRecord) -> str:
        from minirospy.clock import SimulatedClock

        stamp = f"{record.created:f}"
        if isinstance(self._node.clock, SimulatedClock):
            stamp += f", {self._node.clock.now() / 1e9:f}"
        return stamp


class RosoutHandler(logging.Handler):
    """Log records to /rosout."""

    def __init__(self, node: NodeProcess, publisher: Publisher[Any]) -> None:
        super().__init__()
        self._node = node
        self._publisher = publisher
        self._busy = threading.local()

    def emit(self, record: logging.LogRecord) -> None:
        """Publish one record, unless publishing itself is what logs."""
        if getattr(self._busy, "yes", False) or self._node.is_shutdown():
            return
        from rosgraph_msgs.msg import Log

        self._busy.yes = True
        try:
            message = Log()
            seconds, message.header.stamp.nsecs = divmod(self._node.clock.now(), 10**9)
            message.header.stamp.secs = seconds
            message.level = _ROS_LEVEL.get(record.levelno, INFO)
            message.name = self._node.name
            message.msg = record.getMessage()
            message.file = record.pathname
            message.function = record.funcName or ""
            message.line = record.lineno
            message.topics = list(self._node.node.publications) if self._node.node else []
            self._publisher.publish(message)
        except Exception:  # noqa: BLE001 - a log line must never stop the program that logs
            self.handleError(record)
        finally:
            self._busy.yes = False


def _log_file_name(node_name: str) -> str:
    return node_name.strip("/").replace("/", "-") + ".log"


def _logger(name: str | None) -> logging.Logger:
    return logging.getLogger(f"rosout.{name}") if name else _rosout


def _log_function(level: int, name: str) -> LogFunction:
    def log(msg: object, *args: object, logger_name: str | None = None, **kwargs: Any) -> None:
        logger = _logger(logger_name)
        if logger.isEnabledFor(level):
            logger.log(level, msg, *args, stacklevel=2, **kwargs)

    return _named(log, name, f"Log ``msg % args`` at level {_LEVEL_NAME[level]}.")


def _once_function(level: int, name: str) -> LogFunction:
    seen: set[tuple[str, int]] = set()

    def log(msg: object, *args: object, logger_name: str | None = None, **kwargs: Any) -> None:
        place = _caller()
        if place not in seen:
            seen.add(place)
            _logger(logger_name).log(level, msg, *args, stacklevel=2, **kwargs)

    return _named(log, name, f"Log at level {_LEVEL_NAME[level]}, from this place in the code only once.")


def _throttle_function(level: int, name: str, *, identical: bool) -> ThrottledLogFunction:
    last: dict[tuple[str, int], tuple[int, object]] = {}

    def log(period: float, msg: object, *args: object, logger_name: str | None = None, **kwargs: Any) -> None:
        place, now = _caller(), process.clock.now()
        before = last.get(place)
        due = (
            before is None
            or now - before[0] >= period * 1e9
            # Simulated time that jumped back starts anew.
            or now < before[0]
            or (identical and before[1] != msg)
        )
        if due:
            last[place] = (now, msg)
            _logger(logger_name).log(level, msg, *args, stacklevel=2, **kwargs)

    what = "the same text " if identical else ""
    return _named(log, name, f"Log at level {_LEVEL_NAME[level]}, {what}at most once in ``period`` seconds.")


def _named(function: _F, name: str, doc: str) -> _F:
    function.__name__ = function.__qualname__ = name
    function.__doc__ = doc
    return function


def _caller() -> tuple[str, int]:
    frame = sys._getframe(2)
    return frame.f_code.co_filename, frame.f_lineno


logdebug = _log_function(logging.DEBUG, "logdebug")
loginfo = _log_function(logging.INFO, "loginfo")
logwarn = _log_function(logging.WARNING, "logwarn")
logerr = _log_function(logging.ERROR, "logerr")
logfatal = _log_function(logging.CRITICAL, "logfatal")
logout = loginfo

logdebug_once = _once_function(logging.DEBUG, "logdebug_once")
loginfo_once = _once_function(logging.INFO, "loginfo_once")
logwarn_once = _once_function(logging.WARNING, "logwarn_once")
logerr_once = _once_function(logging.ERROR, "logerr_once")
logfatal_once = _once_function(logging.CRITICAL, "logfatal_once")

logdebug_throttle = _throttle_function(logging.DEBUG, "logdebug_throttle", identical=False)
loginfo_throttle = _throttle_function(logging.INFO, "loginfo_throttle", identical=False)
logwarn_throttle = _throttle_function(logging.WARNING, "logwarn_throttle", identical=False)
logerr_throttle = _throttle_function(logging.ERROR, "logerr_throttle", identical=False)
logfatal_throttle = _throttle_function(logging.CRITICAL, "logfatal_throttle", identical=False)

logdebug_throttle_identical = _throttle_function(logging.DEBUG, "logdebug_throttle_identical", identical=True)
loginfo_throttle_identical = _throttle_function(logging.INFO, "loginfo_throttle_identical", identical=True)
logwarn_throttle_identical = _throttle_function(logging.WARNING, "logwarn_throttle_identical", identical=True)
logerr_throttle_identical = _throttle_function(logging.ERROR, "logerr_throttle_identical", identical=True)
logfatal_throttle_identical = _throttle_function(
    logging.CRITICAL, "logfatal_throttle_identical", identical=True
)
