"""Functions shared by rosgraph.names and rospy.names.

Source: http://wiki.ros.org/Names, and the behaviour of rosgraph.names, including for None and values of other types.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence

from minirospy.base import names

__all__ = [
    "GLOBALNS", "PRIV_NAME", "REMAP", "SEP", "canonicalize_name", "get_ros_namespace", "is_global", "is_private",
    "isstring", "load_mappings", "make_global_ns", "namespace", "ns_join",
]  # fmt: skip

PRIV_NAME = "~"
SEP = GLOBALNS = "/"
REMAP = ":="


def isstring(s: object) -> bool:
    """Return whether a value is a str."""
    return isinstance(s, str)


def is_global(name: str | None) -> bool | str | None:
    """Return whether a name starts with ``/``; return None or an empty name unchanged."""
    return name and name[0] == SEP


def is_private(name: str | None) -> bool | str | None:
    """Return whether a name starts with ``~``; return None or an empty name unchanged."""
    return name and name[0] == PRIV_NAME


def namespace(name: str) -> str:
    """Return a name's namespace with a trailing slash. Raise ValueError for None, TypeError for other non-strings."""
    if name is None:
        raise ValueError("name")
    if not isinstance(name, str):
        raise TypeError("name")
    return names.namespace_of(name)


def ns_join(ns: str | None, name: str) -> str:
    """Join a namespace and a name; return global and private names unchanged."""
    if is_private(name) or is_global(name) or not ns:
        return name
    return ns + name if ns == PRIV_NAME or ns[-1] == SEP else ns + SEP + name


def canonicalize_name(name: str) -> str:
    """Return a name without doubled or trailing slashes; return None or an empty name unchanged."""
    return names.canonicalize(name)


def load_mappings(argv: Sequence[str]) -> dict[str, str]:
    """Return the command line's remappings, unresolved, without private parameters."""
    arguments = names.parse_arguments(argv)
    return {**arguments.remappings, **arguments.special}


def get_ros_namespace(env: Mapping[str, str] | None = None, argv: Sequence[str] | None = None) -> str:
    """Return the namespace from the command line (``__ns:=``) or the environment, with slashes at both ends."""
    named = names.parse_arguments(sys.argv if argv is None else argv).special.get("__ns")
    return make_global_ns(named or (os.environ if env is None else env).get("ROS_NAMESPACE") or GLOBALNS)


def make_global_ns(name: str) -> str:
    """Convert a name to a global namespace, with slashes at both ends. Raise ValueError for a private name."""
    if is_private(name):
        raise ValueError(f"cannot turn [{name}] into a global name")
    name = name if is_global(name) else SEP + name
    return name if name[-1] == SEP else name + SEP
