"""rospy.core: functions for the node's life cycle, in addition to the names in `minirospy.client`.

Source: the behaviour of rospy.core; its internal log functions write to the log file only.
"""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Callable, Mapping
from logging import NullHandler
from typing import TYPE_CHECKING

from minirospy.base.environment import split_uri
from minirospy.base.errors import ROSException
from minirospy.client import get_node_uri, is_shutdown, signal_shutdown
from minirospy.client.log import (
    logdebug,
    logdebug_once,
    logdebug_throttle,
    logdebug_throttle_identical,
    logerr,
    logerr_once,
    logerr_throttle,
    logerr_throttle_identical,
    logfatal,
    logfatal_once,
    logfatal_throttle,
    logfatal_throttle_identical,
    logger_of,
    loginfo,
    loginfo_once,
    loginfo_throttle,
    loginfo_throttle_identical,
    logout,
    logwarn,
    logwarn_once,
    logwarn_throttle,
    logwarn_throttle_identical,
    places,
    write,
)
from minirospy.client.session import current_session
from minirospy.ros.rospy.rospy.msproxy import xmlrpcapi
from minirospy.ros.rospy.rospy.names import ParameterInvalid, Validator, valid_name

if TYPE_CHECKING:
    from rosgraph_msgs.msg import Log

    from minirospy.client.log import Keywords

__all__ = [
    "MASTER_NAME",
    "ROSRPC",
    "Log",
    "NullHandler",
    "_base_logger",
    "add_client_shutdown_hook",
    "add_preshutdown_hook",
    "add_shutdown_hook",
    "get_node_uri",
    "get_ros_root",
    "is_initialized",
    "is_shutdown",
    "is_shutdown_requested",
    "is_topic",
    "logdebug",
    "logdebug_once",
    "logdebug_throttle",
    "logdebug_throttle_identical",
    "logerr",
    "logerr_once",
    "logerr_throttle",
    "logerr_throttle_identical",
    "logerror",
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
    "parse_rosrpc_uri",
    "register_signals",
    "rospydebug",
    "rospyerr",
    "rospyinfo",
    "rospywarn",
    "signal_shutdown",
    "xmlrpcapi",
]

MASTER_NAME = "master"
ROSRPC = "rosrpc://"
service_logger = logging.getLogger("rospy.service")
topics_logger = logging.getLogger("rospy.topics")
_internal = logging.getLogger("rospy.internal")
rospydebug = _internal.debug
rospyinfo = _internal.info
rospywarn = _internal.warning
rospyerr = _internal.error
logerror = logerr
_LEVELS = {
    "debug": logging.DEBUG,
    "info": logging.INFO,
    "warn": logging.WARNING,
    "warning": logging.WARNING,
    "error": logging.ERROR,
    "critical": logging.CRITICAL,
    "fatal": logging.CRITICAL,
}


def _base_logger(
    msg: object,
    args: tuple[object, ...],
    kwargs: Keywords,
    throttle: float | None = None,
    throttle_identical: bool = False,
    level: str = "info",
    once: bool = False,
) -> None:
    """Log a message with the source position of the caller's caller. rospy's log functions call this.

    ``level`` is a logging.Logger method name (``warning``), ``kwargs`` may contain ``logger_name``.
    """
    logger = logger_of(kwargs.pop("logger_name", None))  # type: ignore[typeddict-item]
    number = _LEVELS[level]
    if not logger.isEnabledFor(number):
        return
    frame = sys._getframe(2)
    if once:
        is_due = places.is_first(frame)
    else:
        is_due = places.is_due(frame, throttle) if throttle else not throttle_identical
        if throttle_identical:
            is_due = places.is_new(frame, msg) or is_due
    if is_due:
        write(logger, number, frame, msg, args, **kwargs)


def is_initialized() -> bool:
    """Return whether init_node has been called."""
    return current_session().initialized


def is_shutdown_requested() -> bool:
    """Return whether a shutdown has started; while its hooks run, is_shutdown() still returns False."""
    return current_session().lifecycle.is_shutdown_requested


def add_preshutdown_hook(h: Callable[[object], object]) -> None:
    """Call ``h(reason)`` at shutdown, after the on_shutdown hooks and while is_shutdown() still returns False.

    Raise TypeError if ``h`` is not callable.
    """
    lifecycle = current_session().lifecycle
    lifecycle.add_hook(_given_reason(h), lifecycle.late_hooks)


def add_shutdown_hook(h: Callable[[object], object]) -> None:
    """Call ``h(reason)`` at shutdown, once is_shutdown() returns True. Raise TypeError if ``h`` is not callable."""
    lifecycle = current_session().lifecycle
    lifecycle.add_hook(_given_reason(h), lifecycle.interrupts)


def add_client_shutdown_hook(h: Callable[[], object]) -> None:
    """Call ``h()`` at shutdown, like rospy.on_shutdown."""
    current_session().lifecycle.add_hook(h)


def register_signals() -> None:
    """Like init_node, make SIGINT and SIGTERM shut the node down. Works only in the main thread."""
    current_session().signals.install()


def get_ros_root(required: bool = False, env: Mapping[str, str] | None = None) -> str | None:
    """Return ROS_ROOT from the environment. If it is not set, raise ROSException if ``required``, else return None."""
    root = (os.environ if env is None else env).get("ROS_ROOT")
    if required and not root:
        raise ROSException("ROS_ROOT is not set")
    return root


def parse_rosrpc_uri(uri: str) -> tuple[str, int]:
    """Return the (host, port) in a service's ``rosrpc://host:port``. Raise ParameterInvalid if it is invalid."""
    if not uri.startswith(ROSRPC):
        raise ParameterInvalid(f"Invalid protocol for ROS service URL: {uri}")
    try:
        host, port, _ = split_uri(uri, "rosrpc")
    except ValueError:
        raise ParameterInvalid(f"ROS service URL is invalid: {uri}") from None
    return host, port


def is_topic(param_name: str) -> Validator:
    """Return a validator for topic names. For other values, it raises ParameterInvalid with ``param_name`` in the message."""
    resolved = valid_name(param_name)

    def check(param_value: object, caller_id: str) -> str:
        if param_value == "/":
            raise ParameterInvalid(f"ERROR: parameter [{param_name}] cannot be the global namespace")
        return resolved(param_value, caller_id)

    return check


def _given_reason(h: Callable[[object], object]) -> Callable[[], object]:
    """Return a function without arguments that calls ``h(reason)``. Raise TypeError if ``h`` is not callable."""
    if not callable(h):
        raise TypeError(f"shutdown hook [{h}] must be a function or callable object: {type(h)}")
    lifecycle = current_session().lifecycle
    is_late = lifecycle.is_shutdown()
    return lambda: h("already shutdown" if is_late else lifecycle.reason)
