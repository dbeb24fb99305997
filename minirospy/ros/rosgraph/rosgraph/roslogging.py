"""rosgraph.roslogging: names used in logging configuration files, and by programs that subclass its classes."""

from __future__ import annotations

import contextlib
import logging
import os
import sys

from minirospy.client.log_handlers import RosStreamHandler

__all__ = [
    "LoggingException",
    "RosStreamHandler",
    "RospyLogger",
    "_color_reset",
    "_defaultFormatter",
    "_logging_to_rospy_names",
    "configure_logging",
    "makedirs_with_parent_perms",
    "renew_latest_logdir",
]

_FILE_BYTES = 50_000_000  # bytes after which a new log file is started
_FILE_BACKUPS = 4  # number of old log files to keep
_FORMAT = "[%(name)s][%(levelname)s] %(asctime)s: %(message)s"


class LoggingException(Exception):
    """Raised if logging cannot be configured."""


class RospyLogger(logging.Logger):
    """rospy's logger class, which minirospy does not need but programs patch."""


def configure_logging(
    logname: str, level: int = logging.INFO, filename: str | None = None, env: dict[str, str] | None = None
) -> str | None:
    """Log to a file in the log folder; also log `rosout` records to the terminal. Return the file's path.

    Replace the handlers of the root logger and of `rosout`; ``level`` has no effect, as in ROS. A configuration file
    (ROS_PYTHON_LOG_CONFIG_FILE, or a file in ROS_HOME) takes precedence over these settings. Set ROS_LOG_FILENAME to the path.
    Return None, with a warning, if the folder cannot be created. Raise LoggingException if a file has the folder's name.
    """
    from pathlib import Path

    from minirospy.client.log_setup import configured_by_file
    from minirospy.ros.rospkg.rospkg.environment import get_log_dir, get_ros_home
    from minirospy.runtime.master.log_file import LogFileHandler

    log_dir = get_log_dir(env)
    path = os.path.join(log_dir, filename or f"{logname or 'unknown'}-{os.getpid()}.log")
    folder = os.path.dirname(path)
    if os.path.isfile(folder):
        raise LoggingException(f"Cannot save log files: file [{folder}] is in the way")
    try:
        makedirs_with_parent_perms(folder)
    except OSError:
        sys.stderr.write(
            f"WARNING: cannot create log directory [{folder}]. Please set ROS_LOG_DIR to a writable location.\n"
        )
        return None
    if folder != log_dir and os.name != "nt":
        try:
            if not renew_latest_logdir(folder):
                sys.stderr.write("INFO: cannot create a symlink to latest log directory\n")
        except OSError as error:
            sys.stderr.write(f"INFO: cannot create a symlink to latest log directory: {error}\n")

    os.environ["ROS_LOG_FILENAME"] = path
    if configured_by_file(Path(get_ros_home(env))):
        return path

    class RotatingFileHandler(LogFileHandler):
        """Writes log files. Programs search the root logger's handlers for a class of this name."""

    try:
        file = RotatingFileHandler(Path(path), _FILE_BYTES, _FILE_BACKUPS)
    except OSError as error:
        raise LoggingException(f"cannot write the log file [{path}]: {error.strerror}") from error
    for logger, handler in ((logging.getLogger(), file), (logging.getLogger("rosout"), RosStreamHandler())):
        handler.setLevel(logging.DEBUG)
        handler.setFormatter(logging.Formatter(_FORMAT))
        for old in list(logger.handlers):
            logger.removeHandler(old)
        logger.addHandler(handler)
        logger.setLevel(logging.INFO)
    return path


def makedirs_with_parent_perms(p: str) -> None:
    """Create a folder and its parents with the owner and permissions of the nearest existing parent."""
    path = os.path.abspath(p)
    parent = os.path.dirname(path)
    if os.path.exists(path) or parent == path:
        return
    makedirs_with_parent_perms(parent)
    try:
        os.mkdir(path)
    except FileExistsError:
        return  # another process has created the folder in the meantime
    wanted, made = os.stat(parent), os.stat(path)
    # Only root may change a folder's owner. A folder made by another user remains theirs, even in root's /tmp.
    with contextlib.suppress(PermissionError):
        if os.name != "nt" and (wanted.st_uid, wanted.st_gid) != (made.st_uid, made.st_gid):
            os.chown(path, wanted.st_uid, wanted.st_gid)
        if wanted.st_mode != made.st_mode:
            os.chmod(path, wanted.st_mode)


def renew_latest_logdir(logfile_dir: str) -> bool:
    """Create a link `latest` to a run's folder, next to that folder. Return False if a `latest` exists that is not a link."""
    latest = os.path.join(os.path.dirname(logfile_dir), "latest")
    if os.path.lexists(latest):
        if not os.path.islink(latest):
            return False
        os.remove(latest)
    os.symlink(logfile_dir, latest)
    return True


# Programs use these private names of ROS's module.
_color_reset = "\033[0m"
_logging_to_rospy_names = {
    "DEBUG": ("DEBUG", "\033[32m"),
    "INFO": ("INFO", None),
    "WARNING": ("WARN", "\033[33m"),
    "ERROR": ("ERROR", "\033[31m"),
    "CRITICAL": ("FATAL", "\033[31m"),
}
_defaultFormatter = logging.Formatter()
