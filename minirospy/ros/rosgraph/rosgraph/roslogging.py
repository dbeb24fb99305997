"""rosgraph.roslogging: the names used in logging configuration files, and by programs that subclass its classes."""

from __future__ import annotations

import logging
import os

from minirospy.client.log_handlers import RosStreamHandler

__all__ = [
    "LoggingException",
    "RosStreamHandler",
    "RospyLogger",
    "_color_reset",
    "_defaultFormatter",
    "_logging_to_rospy_names",
    "configure_logging",
]


class LoggingException(Exception):
    """Logging cannot be configured."""


class RospyLogger(logging.Logger):
    """rospy's logger class. minirospy finds a call's line without it; the class exists for programs that patch it."""


def configure_logging(
    logname: str, level: int = logging.INFO, filename: str | None = None, env: dict[str, str] | None = None
) -> str | None:
    """Log to a file in the log folder; set ROS_LOG_FILENAME to the file's path, and return the path."""
    from pathlib import Path

    from minirospy.ros.rospkg.rospkg.environment import get_log_dir
    from minirospy.runtime.master.log_file import LogFileHandler

    path = Path(get_log_dir(env)) / (filename or f"{logname}-{os.getpid()}.log")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handler = LogFileHandler(path)
    except OSError as error:
        raise LoggingException(f"cannot write the log file [{path}]: {error.strerror}") from error
    handler.setFormatter(logging.Formatter("[%(name)s][%(levelname)s] %(asctime)s: %(message)s"))
    logging.getLogger().addHandler(handler)
    logging.getLogger(logname).setLevel(level)
    os.environ["ROS_LOG_FILENAME"] = str(path)
    return str(path)


# These are private names in ROS's module that programs read and change.
_color_reset = "\033[0m"
_logging_to_rospy_names = {
    "DEBUG": ("DEBUG", "\033[32m"),
    "INFO": ("INFO", None),
    "WARNING": ("WARN", "\033[33m"),
    "ERROR": ("ERROR", "\033[31m"),
    "CRITICAL": ("FATAL", "\033[31m"),
}
_defaultFormatter = logging.Formatter()
