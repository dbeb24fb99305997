"""ROS 1 for any computer with Python.

``import minirospy as rospy`` offers what ``import rospy`` does: the names below are loaded when they are
first used, so that a command which needs none of them starts quickly.

The path of a message, file by file::

    Bool.msg -> core/idl/parse -> spec -> core/idl/emit -> class
    publish  -> client/publisher (serialize, caller's thread) -> runtime/node/publication.Publication
             -> runtime/transport/links.OutLink ==> TCP ==>
    runtime/transport/readers.read_frames (worker) -> core/wire/framing -> runtime/node/subscription.Subscription
             -> client/subscriber (deserialize, user's function)

and how the two ends find each other: client/publisher -> runtime/node/node -> runtime/master/master -> core/graph/registry ->
publisherUpdate -> runtime/node/slave -> runtime/node/subscription -> core/graph/subscription (whom to connect) -> requestTopic
-> core/wire/tcpros (headers).
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from minirospy.aio import Node as Node
    from minirospy.client import *  # noqa: F403 - the names that __getattr__ finds, for mypy and editors
    from minirospy.ros.rospy.rospy.core import get_ros_root as get_ros_root
    from minirospy.ros.rospy.rospy.core import parse_rosrpc_uri as parse_rosrpc_uri
    from minirospy.ros.rospy.rospy.msproxy import MasterProxy as MasterProxy
    from minirospy.ros.rospy.rospy.msproxy import get_master as get_master

__version__ = "0.1.0"

_ELSEWHERE = {
    "Node": "minirospy.aio",
    "MasterProxy": "minirospy.ros.rospy.rospy.msproxy",
    "get_master": "minirospy.ros.rospy.rospy.msproxy",
    "get_ros_root": "minirospy.ros.rospy.rospy.core",
    "parse_rosrpc_uri": "minirospy.ros.rospy.rospy.core",
}
"""Public names that are not in `minirospy.client`."""


def __getattr__(name: str) -> Any:
    if name.startswith("_"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    try:
        return importlib.import_module(f"{__name__}.{name}")
    except ModuleNotFoundError as error:
        if error.name != f"{__name__}.{name}":
            raise
    client = importlib.import_module(_ELSEWHERE.get(name, "minirospy.client"))
    try:
        return getattr(client, name)
    except AttributeError:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}") from None


def __dir__() -> list[str]:
    return sorted({*globals(), *_ELSEWHERE, *importlib.import_module("minirospy.client").__all__})
