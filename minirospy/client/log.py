"""Log lines: to the terminal, to the node's log file, and to /rosout.

Everything goes through Python's ``logging``, by the logger "rosout" and its children, so that a program
may add its own handlers. Source: http://wiki.ros.org/rospy/Overview/Logging.
"""

from __future__ import annotations

import contextlib
import logging
import os
import re
import sys
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any, Protocol, TextIO, TypeVar

from minirospy import times
from minirospy.client.session import current_session
from minirospy.clock import SimulatedClock
from minirospy.log_levels import (
    DEBUG,
    ERROR,
    FATAL,
    INFO,
    PYTHON_LEVELS,
    SEVERITIES,
    WARN,
    logger_levels,
    ros_level,
    set_logger_level,
)

if TYPE_CHECKING:
    from typing import TypedDict

    from roscpp.srv import SetLoggerLevelRequest
    from typing_extensions import Unpack

    from minirospy.client.session import Session

    class _Keywords(TypedDict, total=False):
        """The keywords that a log function passes to Python's logging."""

        exc_info: object
        extra: Mapping[str, object] | None
        stack_info: bool
        stacklevel: int


__all__ = [
    "DEBUG",
    "ERROR",
    "FATAL",
    "INFO",
    "WARN",
    "RosOutHandler",
    "RosStreamHandler",
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
    "start",
]

_COLOUR = {
    logging.DEBUG: "\033[32m",
    logging.WARNING: "\033[33m",
    logging.ERROR: "\033[31m",
    logging.CRITICAL: "\033[31m",
}
_DEFAULT_FORMAT = "[${severity}] [${time}]: ${message}"
_FIELD = re.compile(r"\$\{(\w+)(?::([^}]*))?\}")
_FILE_FORMAT = "[%(name)s][%(levelname)s] %(asctime)s: %(message)s"
_FILE_BYTES = 50_000_000
_FILE_BACKUPS = 4
_rosout = logging.getLogger("rosout")
_log = logging.getLogger(__name__)
_text = logging.Formatter()
_F = TypeVar("_F", bound=Callable[..., None])


class LogFunction(Protocol):
    """``loginfo`` and its kin."""

    def __call__(
        self, msg: object, *args: object, logger_name: str | None = None, **kwargs: Unpack[_Keywords]
    ) -> None:
        """Log ``msg % args``; ``logger_name`` names a logger below "rosout"."""


class ThrottledLogFunction(Protocol):
    """``loginfo_throttle`` and its kin."""

    def __call__(
        self,
        period: float | times.Duration,
        msg: object,
        *args: object,
        logger_name: str | None = None,
        **kwargs: Unpack[_Keywords],
    ) -> None:
        """Log, but from this place in the code at most once in ``period`` seconds."""


def configure(session: Session, log_level: int | None, log_file: str | None) -> None:
    """Set up the handlers for the node: terminal, log file. ``log_file``: the ``__log:=`` argument.

    A configuration of the user's own (ROS_PYTHON_LOG_CONFIG_FILE, or config/python_logging.conf or .yaml in
    ROS_HOME) is followed instead, as http://wiki.ros.org/rospy/Overview/Logging has it. A file that cannot be
    written or read is reported in one line. Raises ValueError on a log level that is not one of rospy's.
    """
    if log_level is not None and log_level not in PYTHON_LEVELS:
        raise ValueError(
            f"log_level [{log_level}] is not one of rospy.DEBUG (1), INFO (2), WARN (4), ERROR (8), FATAL (16)"
        )
    path = (
        Path(log_file).absolute()
        if log_file
        else session.identity.environment.log_dir / _log_file_name(session.name)
    )
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError:
        _warn(f"cannot create log directory [{path.parent}]. Please set ROS_LOG_DIR to a writable location.")
    # For a configuration file of the user's, and for programs that look for their log.
    os.environ["ROS_LOG_FILENAME"] = str(path)
    if not _configured_by_file(session):
        _rosout.setLevel(logging.INFO)
        _add_handler(session, _rosout, RosStreamHandler())
        _log_to_file(session, path)
    if log_level is not None:
        _rosout.setLevel(PYTHON_LEVELS[log_level])
    # Warnings of the library itself go to the same places.
    ours = logging.getLogger("minirospy")
    ours.setLevel(logging.DEBUG if log_level == DEBUG else logging.INFO)
    terminal = RosStreamHandler()
    terminal.setLevel(logging.DEBUG if log_level == DEBUG else logging.WARNING)
    _add_handler(session, ours, terminal)
    if path.parent.parent == session.identity.environment.log_dir:
        _link_latest(path.parent)


def start(session: Session, *, rosout: bool) -> None:
    """Offer the node's logger services, and publish to ``/rosout`` where ``rosout`` is set."""
    _offer_logger_services()
    if rosout:
        _start_rosout(session)
    _log.debug("init_node, name[%s], pid[%s]", session.name, os.getpid())


def _start_rosout(session: Session) -> None:
    """Publish log lines to /rosout."""
    from minirospy.client.params import get_param

    tell_topics = not get_param("/rosout_disable_topics_generation", False)
    _add_handler(session, _rosout, RosOutHandler(tell_topics=tell_topics))


def _add_handler(session: Session, logger: logging.Logger, handler: logging.Handler) -> None:
    """Add ``handler`` to ``logger`` until the process becomes another node."""
    logger.addHandler(handler)
    session.on_replaced.append(lambda: logger.removeHandler(handler))


def _offer_logger_services() -> None:
    """Offer the node's services that list and set the levels of its loggers."""
    from roscpp.msg import Logger
    from roscpp.srv import GetLoggers, GetLoggersResponse, SetLoggerLevel, SetLoggerLevelResponse

    from minirospy.client.services import Service

    def get_loggers(request: object) -> GetLoggersResponse:
        levels = logger_levels(sorted(logging.root.manager.loggerDict))
        return GetLoggersResponse([Logger(*each) for each in levels.items()])

    def set_level(request: SetLoggerLevelRequest) -> SetLoggerLevelResponse:
        try:
            set_logger_level(request.logger, request.level)
        except ValueError as error:
            _log.error("log level of logger [%s]: %s", request.logger, error)
        return SetLoggerLevelResponse()

    Service("~get_loggers", GetLoggers, get_loggers)
    Service("~set_logger_level", SetLoggerLevel, set_level)


class _DeferringHandler(logging.Handler):
    """Files and streams are not reentrant: a signal waits until a record is written."""

    def handle(self, record: logging.LogRecord) -> bool:
        """Write one record."""
        with current_session().lifecycle.deferral:
            return super().handle(record)


class RosStreamHandler(_DeferringHandler):
    """Lines as rospy prints them: debug and info to stdout, the rest to stderr, coloured on a terminal.

    ROSCONSOLE_FORMAT chooses the form (http://wiki.ros.org/rosconsole#Console_Output_Formatting).
    """

    def __init__(
        self, colorize: bool = True, stdout: TextIO | None = None, stderr: TextIO | None = None
    ) -> None:
        """``stdout``, ``stderr``: where to write; None: what ``sys`` has while a line is written."""
        super().__init__()
        self._colorize = colorize
        self._stdout = stdout
        self._stderr = stderr

    def emit(self, record: logging.LogRecord) -> None:
        """Write one line. A message that does not take its arguments raises TypeError, as rospy's does."""
        line = _line(record)
        is_fine = record.levelno < logging.WARNING
        stream = (self._stdout or sys.stdout) if is_fine else (self._stderr or sys.stderr)

        try:
            colour = _COLOUR.get(record.levelno) if self._colorize else None
            if colour and stream.isatty():
                line = f"{colour}{line}\033[0m"
            try:
                stream.write(line + "\n")
            except UnicodeEncodeError:
                # A terminal that has not every letter, as on Windows.
                encoding = stream.encoding or "ascii"
                stream.write(line.encode(encoding, "backslashreplace").decode(encoding) + "\n")
            stream.flush()
        except RuntimeError:
            # A signal handler logs while the line that it interrupted is being written.
            with contextlib.suppress(OSError, ValueError):
                os.write(stream.fileno(), (line + "\n").encode(errors="backslashreplace"))
        except (OSError, ValueError, AttributeError):
            # Without a terminal, or with one that was closed, which is not an error of the program.
            pass


class RosOutHandler(_DeferringHandler):
    """Log records to /rosout (http://wiki.ros.org/rosout); for a logger of the program's own, too."""

    def __init__(self, level: int = 0, *, tell_topics: bool = True) -> None:
        """``tell_topics``: say what the node publishes in each line."""
        from rosgraph_msgs.msg import Log

        from minirospy.client.publisher import Publisher

        super().__init__(level)
        self._publisher = Publisher("/rosout", Log, latch=True, queue_size=100)
        self._tell_topics = tell_topics
        self._busy = threading.local()

    def emit(self, record: logging.LogRecord) -> None:
        """Publish one record, unless publishing itself is what logs."""
        session = current_session()
        node = session.node
        if getattr(self._busy, "yes", False) or node is None or session.is_shutdown():
            return

        self._busy.yes = True
        try:
            message = self._publisher.data_class()
            stamp = message.header.stamp
            stamp.secs, stamp.nsecs = divmod(session.clock.now(), 10**9)
            message.level = ros_level(record.levelno)
            message.name = session.name
            message.msg = _message(record)
            message.file = record.filename
            message.function = record.funcName or ""
            message.line = record.lineno
            if self._tell_topics:
                message.topics = list(node.publications)
            self._publisher.publish(message)
        except Exception as error:  # noqa: BLE001 - a log line must never stop the program that logs
            print(f"Unable to report rosout: {error}", file=sys.stderr)
        finally:
            self._busy.yes = False


def _configured_by_file(session: Session) -> bool:
    """Follow the user's own configuration of ``logging``, where there is one."""
    named = os.environ.get("ROS_PYTHON_LOG_CONFIG_FILE")
    folder = session.identity.environment.home / "config"
    found = [folder / f"python_logging.{kind}" for kind in ("conf", "yaml", "yml")]
    for path in [Path(named)] if named else [path for path in found if path.is_file()]:
        import logging.config

        try:
            if not path.is_file():
                raise FileNotFoundError("the file does not exist")
            if path.suffix in (".yaml", ".yml"):
                import yaml

                with path.open(encoding="utf-8") as file:
                    logging.config.dictConfig({"disable_existing_loggers": False, **yaml.safe_load(file)})
            else:
                logging.config.fileConfig(path, disable_existing_loggers=False)
        except Exception as error:  # noqa: BLE001 - a file that a person wrote; logging raises all sorts
            why = " ".join(str(error).split()) or type(error).__name__
            _warn(f"cannot load logging configuration file [{path}], the usual one is used: {why}")
            continue
        return True
    return False


def _log_to_file(session: Session, path: Path) -> None:
    """All loggers to the node's file, as rospy has it, and nothing twice on the terminal."""
    from minirospy.runtime.master.log_file import LogFileHandler

    class RotatingFileHandler(_DeferringHandler, LogFileHandler):
        """Of the name that programs find among the root logger's handlers with rospy."""

    try:
        file = RotatingFileHandler(path, _FILE_BYTES, _FILE_BACKUPS)
    except OSError as error:
        if path.parent.is_dir():
            _warn(f"cannot write the log file [{path}]: {error.strerror}")
        return
    file.setFormatter(logging.Formatter(_FILE_FORMAT))
    root = logging.root
    if not root.handlers:
        root.setLevel(logging.INFO)
    # Handlers that the program itself gave the root before (basicConfig) stay, where rospy takes them
    # away; but what rosout has written to the terminal is not written there again.
    for handler in root.handlers:
        if isinstance(handler, logging.StreamHandler) and handler.stream in (sys.stdout, sys.stderr):
            handler.addFilter(_is_not_ours)
    _add_handler(session, root, file)


def _is_not_ours(record: logging.LogRecord) -> bool:
    return record.name.partition(".")[0] not in ("rosout", "minirospy")


def _link_latest(folder: Path) -> None:
    """``latest`` beside the folder of a run is a link to it."""
    link = folder.parent / "latest"
    # No links on this file system, or another node was faster.
    with contextlib.suppress(OSError, NotImplementedError):
        if link.is_symlink():
            if link.resolve() == folder.resolve():
                return
            link.unlink()
        link.symlink_to(folder, target_is_directory=True)


def _log_file_name(node_name: str) -> str:
    return node_name.strip("/").replace("/", "_") + ".log"


def _warn(text: str) -> None:
    print(f"WARNING: {text}", file=sys.stderr)


def _message(record: logging.LogRecord) -> str:
    text = record.getMessage()
    if record.exc_info and not record.exc_text:
        record.exc_text = _text.formatException(record.exc_info)
    return f"{text}\n{record.exc_text}" if record.exc_text else text


def _line(record: logging.LogRecord) -> str:
    message = _message(record)
    severity = SEVERITIES.get(record.levelno, record.levelname)
    template = os.environ.get("ROSCONSOLE_FORMAT")
    if not template or template == _DEFAULT_FORMAT:
        return f"[{severity}] [{_stamp(record)}]: {message}"
    fields: dict[str, Callable[[str | None], object]] = {
        "severity": lambda _: severity,
        "message": lambda _: message,
        "time": lambda form: _stamp(record, form),
        "walltime": lambda form: _wall_time(record, form),
        "thread": lambda _: record.thread,
        "logger": lambda _: record.name,
        "file": lambda _: record.pathname,
        "line": lambda _: record.lineno,
        "function": lambda _: record.funcName,
        "node": lambda _: current_session().name,
    }

    def field(found: re.Match[str]) -> str:
        name, form = found.groups()
        if name not in fields or (form is not None and name not in ("time", "walltime")):
            return found[0]
        return str(fields[name](form))

    return _FIELD.sub(field, template)


def _wall_time(record: logging.LogRecord, form: str | None = None) -> str:
    return f"{record.created:f}" if form is None else time.strftime(form, time.localtime(record.created))


def _stamp(record: logging.LogRecord, form: str | None = None) -> str:
    """Wall time, and behind it the simulated time where that is used."""
    wall = _wall_time(record, form)
    clock = current_session().clock
    return f"{wall}, {clock.now() / 1e9:f}" if isinstance(clock, SimulatedClock) else wall


def _logger(name: str | None) -> logging.Logger:
    return logging.getLogger(f"rosout.{name}") if name else _rosout


def _write(
    logger: logging.Logger,
    level: int,
    frame: FrameType,
    msg: object,
    args: tuple[object, ...],
    *,
    exc_info: Any = None,
    extra: Mapping[str, object] | None = None,
    stack_info: bool = False,
    stacklevel: int = 1,
) -> None:
    """Log for the caller at ``frame``. A method is named with its class, as rospy does it."""
    at = frame
    while stacklevel > 1 and at.f_back is not None:
        stacklevel, at = stacklevel - 1, at.f_back
    function = at.f_code.co_name
    if "self" in at.f_code.co_varnames or "self" in at.f_code.co_freevars:
        with contextlib.suppress(KeyError):
            function = f"{type(at.f_locals['self']).__name__}.{function}"
    if isinstance(exc_info, BaseException):
        exc_info = (type(exc_info), exc_info, exc_info.__traceback__)
    elif exc_info and not isinstance(exc_info, tuple):
        exc_info = sys.exc_info()
    stack = None
    if stack_info:
        import traceback

        stack = "Stack (most recent call last):\n" + "".join(traceback.format_stack(at)).rstrip("\n")
    place = at.f_code.co_filename, at.f_lineno
    record = logger.makeRecord(logger.name, level, *place, msg, args, exc_info, function, extra, stack)
    with current_session().lifecycle.deferral:
        logger.handle(record)


def _log_function(level: int, name: str) -> LogFunction:
    def log(msg: object, *args: object, logger_name: str | None = None, **kwargs: Unpack[_Keywords]) -> None:
        logger = _logger(logger_name)
        if logger.isEnabledFor(level):
            _write(logger, level, sys._getframe(1), msg, args, **kwargs)

    return _named(log, name, f"Log ``msg % args`` at level {SEVERITIES[level]}.")


class _Places:
    """Which places in the code have logged: when, and what. A place is one call, whatever function it calls."""

    def __init__(self) -> None:
        self._once: set[tuple[str, int, int]] = set()
        self._times: dict[tuple[str, int, int], int] = {}
        self._texts: dict[tuple[str, int, int], object] = {}

    def is_first(self, frame: FrameType) -> bool:
        """Return whether the call at ``frame`` has not logged before."""
        place = _place(frame)
        if place in self._once:
            return False
        self._once.add(place)
        return True

    def is_due(self, frame: FrameType, period: float | times.Duration) -> bool:
        """Return whether the call at ``frame`` was last due more than ``period`` seconds ago."""
        place, now = _place(frame), current_session().clock.now()
        before = self._times.get(place)
        pause = period.to_nsec() if isinstance(period, times.Duration) else int(period * 1e9)
        # Simulated time has jumped back: start again.
        due = before is None or now - before > pause or now < before
        if due:
            self._times[place] = now
        return due

    def is_new(self, frame: FrameType, text: object) -> bool:
        """Return whether the call at ``frame`` logged another text before, or none."""
        place = _place(frame)
        if place in self._texts and self._texts[place] == text:
            return False
        self._texts[place] = text
        return True


_places = _Places()


def _once_function(level: int, name: str) -> LogFunction:
    def log(msg: object, *args: object, logger_name: str | None = None, **kwargs: Unpack[_Keywords]) -> None:
        logger = _logger(logger_name)
        if logger.isEnabledFor(level):
            frame = sys._getframe(1)
            if _places.is_first(frame):
                _write(logger, level, frame, msg, args, **kwargs)

    return _named(log, name, f"Log at level {SEVERITIES[level]}, from this place in the code only once.")


def _throttle_function(level: int, name: str, *, identical: bool) -> ThrottledLogFunction:
    def log(
        period: float | times.Duration,
        msg: object,
        *args: object,
        logger_name: str | None = None,
        **kwargs: Unpack[_Keywords],
    ) -> None:
        logger = _logger(logger_name)
        if not logger.isEnabledFor(level):
            return
        frame = sys._getframe(1)
        # A period of 0 is none: then the text alone decides, or nothing.
        due = _places.is_due(frame, period) if period else not identical
        if identical:
            due = _places.is_new(frame, msg) or due
        if due:
            _write(logger, level, frame, msg, args, **kwargs)

    what = "the same text " if identical else ""
    return _named(log, name, f"Log at level {SEVERITIES[level]}, {what}at most once in ``period`` seconds.")


def _named(function: _F, name: str, doc: str) -> _F:
    function.__name__ = function.__qualname__ = name
    function.__doc__ = doc
    return function


def _place(frame: FrameType) -> tuple[str, int, int]:
    """Return the place of a call in the code: two calls on one line are two places."""
    return frame.f_code.co_filename, frame.f_lineno, frame.f_lasti


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
