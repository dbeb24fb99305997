"""A node's logging after init_node: its loggers' handlers, its log file and its logger services.

Source: http://wiki.ros.org/rospy/Overview/Logging.
"""

from __future__ import annotations

import contextlib
import logging
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from minirospy.base.log_levels import DEBUG, PYTHON_LEVELS, logger_levels, set_logger_level
from minirospy.base.yaml_text import safe_load
from minirospy.client.log_handlers import DeferringHandler, RosOutHandler, RosStreamHandler

if TYPE_CHECKING:
    from roscpp.srv import SetLoggerLevelRequest

    from minirospy.client.session import Session

__all__ = ["configure", "configured_by_file", "start"]

_FILE_FORMAT = "[%(name)s][%(levelname)s] %(asctime)s: %(message)s"
_FILE_BYTES = 50_000_000
_FILE_BACKUPS = 4
_rosout = logging.getLogger("rosout")
_log = logging.getLogger(__name__)


def configure(session: Session, log_level: int | None, log_file: str | None) -> None:
    """Set up the node's handlers: terminal and log file. ``log_file``: the ``__log:=`` argument.

    A user's configuration file (ROS_PYTHON_LOG_CONFIG_FILE, or config/python_logging.conf or .yaml in ROS_HOME)
    replaces these handlers, as http://wiki.ros.org/rospy/Overview/Logging describes. A file that cannot be
    written or read is reported in one line. Raise ValueError if rospy has no such log level.
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

    # The user's logging configuration file refers to this variable, and programs use it to find their log file.
    os.environ["ROS_LOG_FILENAME"] = str(path)
    if not configured_by_file(session.identity.environment.home):
        _rosout.setLevel(logging.INFO)
        _add_handler(session, _rosout, RosStreamHandler())
        _log_to_file(session, path)
    if log_level is not None:
        _rosout.setLevel(PYTHON_LEVELS[log_level])

    # Print minirospy's own warnings on the terminal in the same format.
    ours = logging.getLogger("minirospy")
    ours.setLevel(logging.DEBUG if log_level == DEBUG else logging.INFO)
    terminal = RosStreamHandler()
    terminal.setLevel(logging.DEBUG if log_level == DEBUG else logging.WARNING)
    # rospy logs its own warnings with the program's logger, so the program's log level may hide them. Do the same.
    terminal.addFilter(lambda record: _rosout.isEnabledFor(record.levelno))
    _add_handler(session, ours, terminal)
    if path.parent.parent == session.identity.environment.log_dir:
        _link_latest(path.parent)


def start(session: Session, *, rosout: bool) -> None:
    """Offer the node's logger services and publish to ``/rosout`` if ``rosout`` is set."""
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
    """Add ``handler`` to ``logger`` until the process creates another node."""
    logger.addHandler(handler)
    session.on_replaced.append(lambda: logger.removeHandler(handler))


def _offer_logger_services() -> None:
    """Offer the services that list the node's loggers and set their levels."""
    from roscpp.msg import Logger
    from roscpp.srv import GetLoggers, GetLoggersResponse, SetLoggerLevel, SetLoggerLevelResponse

    from minirospy.client.service import Service

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


def configured_by_file(home: Path) -> bool:
    """Apply the user's configuration file for ``logging``, by default from ROS_HOME ``home``; return whether one was loaded."""
    named = os.environ.get("ROS_PYTHON_LOG_CONFIG_FILE")
    folder = home / "config"
    found = [folder / f"python_logging.{kind}" for kind in ("conf", "yaml", "yml")]
    for path in [Path(named)] if named else [path for path in found if path.is_file()]:
        import logging.config

        try:
            if not path.is_file():
                raise FileNotFoundError("the file does not exist")
            if path.suffix in (".yaml", ".yml"):
                settings: Any = safe_load(path.read_text(encoding="utf-8"))
                logging.config.dictConfig({"disable_existing_loggers": False, **settings})
            else:
                logging.config.fileConfig(path, disable_existing_loggers=False)
        except Exception as error:  # noqa: BLE001 - a file that a person wrote; logging raises all sorts
            why = " ".join(str(error).split()) or type(error).__name__
            _warn(f"cannot load logging configuration file [{path}], the usual one is used: {why}")
            continue
        return True
    return False


def _log_to_file(session: Session, path: Path) -> None:
    """Write all loggers' output to the node's log file, as rospy does, without duplicating lines on the terminal."""
    from minirospy.runtime.master.log_file import LogFileHandler

    class RotatingFileHandler(DeferringHandler, LogFileHandler):
        """A log file handler. Programs written for rospy look for this class name among the root logger's handlers."""

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
    # Keep handlers that the program has added to the root logger (basicConfig), although rospy removes them.
    # Filter them so that rosout lines do not appear on the terminal twice.
    for handler in root.handlers:
        if isinstance(handler, logging.StreamHandler) and handler.stream in (sys.stdout, sys.stderr):
            handler.addFilter(_is_not_ours)
    _add_handler(session, root, file)


def _is_not_ours(record: logging.LogRecord) -> bool:
    return record.name.partition(".")[0] not in ("rosout", "minirospy")


def _link_latest(folder: Path) -> None:
    """Create the link ``latest`` next to a run's folder, pointing to that folder."""
    link = folder.parent / "latest"
    # Ignore errors: the file system may not support links, or another node may have created the link first.
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
