"""The rospy API: thin blocking twins over `minirospy.runtime`; what `import rospy` re-exports.

Source: http://wiki.ros.org/rospy/Overview.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from typing import Any

from minirospy import names
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
from minirospy.client.process import process
from minirospy.client.services import Service, ServiceProxy, wait_for_service
from minirospy.client.time import Duration, Rate, Time, Timer, get_rostime, get_time, sleep
from minirospy.client.topics import (
    AnyMsg,
    Publisher,
    SubscribeListener,
    Subscriber,
    get_published_topics,
    wait_for_message,
)
from minirospy.errors import (
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
from minirospy.idl.message import Message

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
    "is_shutdown",
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


def init_node(
    name: str,
    argv: Sequence[str] | None = None,
    anonymous: bool = False,
    log_level: int | None = None,
    disable_rostime: bool = False,
    disable_rosout: bool = False,
    disable_signals: bool = False,
    xmlrpc_port: int = 0,
    tcpros_port: int = 0,
) -> None:
    """Make this process the node ``name``; waits for a master.

    ``anonymous`` adds a number, so that many of a name can run. ``log_level``: rospy.DEBUG to rospy.FATAL.
    Raises ValueError on a name that is empty or has a namespace, ROSException when called again with other
    arguments, ROSInitException where the node cannot be set up, ROSInterruptException where it is shut down while it
    waits.
    """
    process.init_node(
        name,
        argv,
        anonymous,
        log_level,
        disable_rostime,
        disable_rosout,
        disable_signals,
        xmlrpc_port,
        tcpros_port,
    )


def spin() -> None:
    """Wait until the node shuts down. Raises ROSInitException before init_node."""
    process.spin()


def is_shutdown() -> bool:
    """Whether the node has shut down."""
    return process.poll_shutdown()


def on_shutdown(h: Callable[[], object]) -> None:
    """Call ``h`` when the node shuts down, before it leaves the graph. Raises TypeError."""
    process.on_shutdown(h)


def signal_shutdown(reason: object) -> None:
    """Shut the node down; hooks run in this thread."""
    process.signal_shutdown(reason)
    # The caller needs no notification: what the thread does now is its clean-up, and may sleep.
    process.poll_shutdown()


def get_name() -> str:
    """This node's global name; ``/unnamed`` before init_node."""
    return process.name


get_caller_id = get_name


def get_namespace() -> str:
    """The namespace of this node, with a slash at its end."""
    return names.namespace_of(process.name)


def get_node_uri() -> str | None:
    """The URI of this node's Slave API; None before init_node."""
    return process.node.uri if process.node else None


def resolve_name(name: str, caller_id: str | None = None) -> str:
    """The global name of ``name`` as this node, or the node ``caller_id``, sees it, remapped."""
    return process.resolve(name, caller_id)


def remap_name(name: str, caller_id: str | None = None, resolved: bool = True) -> str:
    """What the command line has in place of ``name``, as a global name; ``name`` itself where it has nothing."""
    return process.remap(name, caller_id)


def myargv(argv: Sequence[str] | None = None) -> list[str]:
    """The command line without remappings, private parameters and ROS's own arguments."""
    return names.parse_arguments(sys.argv if argv is None else argv).plain


def load_command_line_node_params(argv: Sequence[str]) -> dict[str, Any]:
    """The private parameters of a command line: ``_rate:=5`` is {"rate": 5}. Raises ROSInitException."""
    return private_parameters(names.parse_arguments(argv))
