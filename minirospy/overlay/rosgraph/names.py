"""Names, under the words of rosgraph. Source: http://wiki.ros.org/Names."""

from __future__ import annotations

import os

from minirospy.names import anonymous_name, is_global, is_legal_base_name, is_legal_name, is_private
from minirospy.names import canonicalize as canonicalize_name
from minirospy.names import join as ns_join
from minirospy.names import namespace_of as namespace
from minirospy.names import resolve as resolve_name

__all__ = [
    "ANYTYPE", "GLOBALNS", "PRIV_NAME", "REMAP", "SEP", "anonymous_name", "canonicalize_name", "get_ros_namespace",
    "is_global", "is_legal_base_name", "is_legal_name", "is_private", "make_global_ns", "namespace", "ns_join",
    "resolve_name", "script_resolve_name",
]  # fmt: skip

PRIV_NAME = "~"
SEP = GLOBALNS = "/"
REMAP = ":="
ANYTYPE = "*"


def get_ros_namespace(env: dict[str, str] | None = None, argv: list[str] | None = None) -> str:
    """The namespace of the environment, with slashes around it."""
    return make_global_ns((os.environ if env is None else env).get("ROS_NAMESPACE", "/"))


def make_global_ns(name: str) -> str:
    """A name as a namespace, with slashes around it."""
    return "/" + name.strip("/") + "/" if name.strip("/") else "/"


def script_resolve_name(script_name: str, name: str) -> str:
    """The global name of a name that a script was given on its command line."""
    return resolve_name(name, get_ros_namespace() + script_name) if name else get_ros_namespace()
