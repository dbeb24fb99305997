"""Names, with rosgraph's function names. Source: http://wiki.ros.org/Names."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Mapping, Sequence

from minirospy import names as _names
from minirospy.compat.rosgraph.rosenv import ROS_NAMESPACE

__all__ = [
    "ANYTYPE",
    "BASE_NAME_LEGAL_CHARS_P",
    "GLOBALNS",
    "MSG_EXT",
    "NAME_LEGAL_CHARS_P",
    "PRIV_NAME",
    "REMAP",
    "REMAP_PATTERN",
    "SEP",
    "SRV_EXT",
    "anonymous_name",
    "canonicalize_name",
    "get_ros_namespace",
    "is_global",
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

PRIV_NAME = "~"
SEP = GLOBALNS = "/"
REMAP = ":="
ANYTYPE = "*"
MSG_EXT = ".msg"
SRV_EXT = ".srv"
NAME_LEGAL_CHARS_P = re.compile(r"^[\~\/A-Za-z][\w\/]*$")
BASE_NAME_LEGAL_CHARS_P = re.compile(r"^[A-Za-z][\w]*$")
REMAP_PATTERN = re.compile(r"^([\~\/A-Za-z]|_|__)[\w\/]*:=.*")


def isstring(s: object) -> bool:
    """Return whether a value is a str."""
    return isinstance(s, str)


def is_global(name: str) -> bool:
    """Return whether a name starts at the root."""
    return _names.is_global(name)


def is_private(name: str) -> bool:
    """Return whether a name starts with ``~``."""
    return _names.is_private(name)


def is_legal_remap(arg: str) -> bool:
    """Return whether an argument of a command line is a remapping."""
    return REMAP_PATTERN.match(arg) is not None


def namespace(name: str) -> str:
    """Return the namespace of a name, with a trailing slash."""
    if name is None:
        raise ValueError("name")
    return _names.namespace_of(name)


def ns_join(ns: str, name: str) -> str:
    """Return a name below a namespace; global and private names stay what they are."""
    return _names.join(ns, name)


def canonicalize_name(name: str) -> str:
    """Return a name without doubled or trailing slashes."""
    return _names.canonicalize(name)


def resolve_name(name: str, namespace_: str, remappings: Mapping[str, str] | None = None) -> str:
    """Return the global name of ``name`` as the node ``namespace_`` sees it, remapped."""
    return _names.resolve(name, namespace_, remappings)


def anonymous_name(id: str) -> str:
    """Return a name that no other node has."""
    return _names.anonymous_name(id)


def load_mappings(argv: Sequence[str]) -> dict[str, str]:
    """Return the remappings in a command line, as they are spelled, without private parameters."""
    arguments = _names.parse_arguments(argv)
    return {**arguments.remappings, **arguments.special}


def get_ros_namespace(env: Mapping[str, str] | None = None, argv: Sequence[str] | None = None) -> str:
    """Return the namespace of the command line (``__ns:=``), else of the environment, with slashes around it."""
    named = _names.parse_arguments(sys.argv if argv is None else argv).special.get("__ns")
    return make_global_ns(named or (os.environ if env is None else env).get(ROS_NAMESPACE) or GLOBALNS)


def make_global_ns(name: str) -> str:
    """Return a name as a namespace, with a slash on both ends. Raises ValueError on a private one."""
    if is_private(name):
        raise ValueError(f"cannot turn [{name}] into a global name")
    name = name if is_global(name) else SEP + name
    return name if name.endswith(SEP) else name + SEP


def make_caller_id(name: str) -> str:
    """Return a global name in the namespace of the environment, with a trailing slash."""
    return make_global_ns(ns_join(get_ros_namespace(), name))


def script_resolve_name(script_name: str, name: str) -> str:
    """Return the global name of a name that the command ``script_name`` was given."""
    if not name:
        return get_ros_namespace()
    if is_global(name):
        return name
    if is_private(name):
        return ns_join(make_caller_id(script_name), name[1:])
    return get_ros_namespace() + name
