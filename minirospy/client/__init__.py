"""The rospy API, which `import rospy` re-exports: thin blocking wrappers over `minirospy.runtime`.

Source: http://wiki.ros.org/rospy/Overview.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager

from minirospy.base import names
from minirospy.base.errors import (
    ROSException,
    ROSInitException,
    ROSInternalException,
    ROSInterruptException,
    ROSSerializationException,
    ROSTimeMovedBackwardsException,
    ServiceException,
    TransportException,
    TransportInitError,
    TransportTerminated,
)
from minirospy.base.ros1_imports import prefer_ros1
from minirospy.base.script_names import find_packages_named_like_scripts
from minirospy.client.identity import private_parameters
from minirospy.client.log import (
    DEBUG,
    ERROR,
    FATAL,
    INFO,
    WARN,
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
    loginfo,
    loginfo_once,
    loginfo_throttle,
    loginfo_throttle_identical,
    logout,
    logwarn,
    logwarn_once,
    logwarn_throttle,
    logwarn_throttle_identical,
)
from minirospy.client.params import (
    delete_param,
    get_param,
    get_param_cached,
    get_param_names,
    has_param,
    search_param,
    set_param,
)
from minirospy.client.service import Service
from minirospy.client.service_proxy import ServiceProxy, wait_for_service
from minirospy.client.session import current_session
from minirospy.client.startup import init_node
from minirospy.client.time import Duration, Rate, Time, Timer, get_rostime, get_time, is_wallclock, sleep
from minirospy.client.topics import (
    AnyMsg,
    Publisher,
    SubscribeListener,
    Subscriber,
    get_published_topics,
    wait_for_message,
)
from minirospy.core.idl.message import Message

__all__ = [
    "DEBUG",
    "ERROR",
    "FATAL",
    "INFO",
    "WARN",
    "AnyMsg",
    "Duration",
    "Message",
    "Publisher",
    "ROSException",
    "ROSInitException",
    "ROSInternalException",
    "ROSInterruptException",
    "ROSSerializationException",
    "ROSTimeMovedBackwardsException",
    "Rate",
    "Service",
    "ServiceException",
    "ServiceProxy",
    "SubscribeListener",
    "Subscriber",
    "Time",
    "Timer",
    "TransportException",
    "TransportInitError",
    "TransportTerminated",
    "delete_param",
    "get_caller_id",
    "get_name",
    "get_namespace",
    "get_node_uri",
    "get_param",
    "get_param_cached",
    "get_param_names",
    "get_published_topics",
    "get_rostime",
    "get_time",
    "has_param",
    "init_node",
    "interrupting",
    "is_down",
    "is_shutdown",
    "is_shutdown_requested",
    "is_wallclock",
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
    "myargv",
    "on_shutdown",
    "remap_name",
    "resolve_name",
    "search_param",
    "set_param",
    "signal_shutdown",
    "sleep",
    "spin",
    "wait_for_message",
    "wait_for_service",
]

# Do this before the first message is imported: if ROS 2 is sourced, its packages with the same names come first on the path.
prefer_ros1()
find_packages_named_like_scripts()


def spin() -> None:
    """Wait until the node shuts down. Raise ROSInitException if init_node has not been called."""
    current_session().spin()


def is_shutdown() -> bool:
    """Return whether the node has shut down."""
    return current_session().poll_shutdown()


def on_shutdown(h: Callable[[], object]) -> None:
    """Call ``h`` when the node shuts down, before it leaves the graph. Raise TypeError if ``h`` is not callable."""
    current_session().lifecycle.add_hook(h)


def signal_shutdown(reason: object) -> None:
    """Shut the node down; the hooks run in this thread."""
    current_session().lifecycle.signal_shutdown(reason)
    # Mark the calling thread as notified of the shutdown: its sleeps no longer raise, because it is only cleaning up.
    current_session().poll_shutdown()


def get_name() -> str:
    """Return this node's global name; ``/unnamed`` before init_node."""
    return current_session().name


get_caller_id = get_name


def get_namespace() -> str:
    """Return the namespace of this node, with a trailing slash."""
    return current_session().identity.namespace


def get_node_uri() -> str | None:
    """Return the URI of this node's Slave API, or None before init_node."""
    node = current_session().node
    return node.uri if node else None


def is_shutdown_requested() -> bool:
    """Return whether a shutdown has started. is_shutdown() still returns False while the shutdown hooks run."""
    return current_session().lifecycle.is_shutdown_requested


def is_down() -> bool:
    """Return whether the node has shut down.

    Unlike is_shutdown(), this does not record that the calling thread polls, so libraries may use it.
    """
    return current_session().is_shutdown()


def interrupting(interrupt: Callable[[], object]) -> AbstractContextManager[None]:
    """Call ``interrupt``, in any thread, if the node shuts down during the block.

    ``interrupt`` must unblock the calls made in the block.
    """
    return current_session().lifecycle.interrupting(interrupt)


def resolve_name(name: str, caller_id: str | None = None) -> str:
    """Remap ``name`` and return it as a global name, resolved relative to this node or to the node ``caller_id``."""
    return current_session().resolve(name and str(name), caller_id)


def remap_name(name: str, caller_id: str | None = None, resolved: bool = True) -> str:
    """Return the global name to which the command line remaps ``name``, or ``name`` itself if it is not remapped."""
    return current_session().identity.remap(name, caller_id)


def myargv(argv: Sequence[str] | None = None) -> list[str]:
    """Return the command line without remappings, private parameters and ROS's own arguments."""
    return names.parse_arguments(sys.argv if argv is None else argv).plain


def load_command_line_node_params(argv: Sequence[str]) -> dict[str, object]:
    """Return the private parameters on a command line; ``_rate:=5`` yields {"rate": 5}.

    Raise ROSInitException if a value is not valid YAML.
    """
    return private_parameters(names.parse_arguments(argv))
