"""Functions for graph names, named as in ROS's rosgraph.names. Source: http://wiki.ros.org/Names."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING

from minirospy.base import names as _names
from minirospy.ros.ros_names import (
    GLOBALNS,
    PRIV_NAME,
    REMAP,
    SEP,
    canonicalize_name,
    get_ros_namespace,
    is_global,
    is_private,
    isstring,
    load_mappings,
    make_global_ns,
    namespace,
    ns_join,
)

if TYPE_CHECKING:
    from minirospy.ros.rosgraph.rosgraph.rosenv import ROS_NAMESPACE

__all__ = [
    "ANYTYPE",
    "BASE_NAME_LEGAL_CHARS_P",
    "GLOBALNS",
    "MSG_EXT",
    "NAME_LEGAL_CHARS_P",
    "PRIV_NAME",
    "REMAP",
    "REMAP_PATTERN",
    "ROS_NAMESPACE",
    "SEP",
    "SRV_EXT",
    "anonymous_name",
    "canonicalize_name",
    "get_ros_namespace",
    "is_global",
    "is_legal_base_name",
    "is_legal_name",
    "is_legal_remap",
    "is_private",
    "isstring",
    "load_mappings",
    "make_caller_id",
    "make_global_ns",
    "namespace",
    "ns_join",
    "resolve_name",
    "script_resolve_name",
]

ANYTYPE = "*"
MSG_EXT = ".msg"
SRV_EXT = ".srv"
NAME_LEGAL_CHARS_P = re.compile(r"^[\~\/A-Za-z][\w\/]*$")
BASE_NAME_LEGAL_CHARS_P = re.compile(r"^[A-Za-z][\w]*$")
REMAP_PATTERN = re.compile(r"^([\~\/A-Za-z]|_|__)[\w\/]*:=.*")


def is_legal_remap(arg: str | None) -> bool:
    """Return whether a command-line argument is a name remapping."""
    return arg is not None and REMAP_PATTERN.match(arg) is not None


def is_legal_name(name: str | None) -> bool:
    """Return whether a string is a legal graph name."""
    return name is not None and _names.is_legal_name(name)


def is_legal_base_name(name: str | None) -> bool:
    """Return whether a string is a legal graph name without a namespace."""
    return name is not None and _names.is_legal_base_name(name)


def resolve_name(name: str, namespace_: str, remappings: Mapping[str, str] | None = None) -> str:
    """Resolve ``name`` to a global name, relative to the node ``namespace_``, and apply the remappings."""
    name = canonicalize_name(name)
    if not is_global(name) and not is_private(name):
        # Raise ValueError if ``namespace_`` is invalid.
        namespace(namespace_)
    return _names.resolve(name, namespace_, remappings)


def anonymous_name(id: str) -> str:
    """Return a unique name that starts with ``id``."""
    return _names.anonymous_name(id)


def make_caller_id(name: str) -> str:
    """Return a global name in the environment's namespace, with a trailing slash."""
    return make_global_ns(ns_join(get_ros_namespace(), name))


def script_resolve_name(script_name: str, name: str) -> str:
    """Resolve a name given to the command ``script_name`` to a global name."""
    if not name:
        return get_ros_namespace()
    if is_global(name):
        return name
    if is_private(name):
        return ns_join(make_caller_id(script_name), name[1:])
    return get_ros_namespace() + name
