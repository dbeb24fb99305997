"""roslib.names: rosgraph's names, and those of resources (``package/name``)."""

import re

from minirospy.ros.rosgraph.rosgraph.names import (
    ANYTYPE,
    GLOBALNS,
    PRIV_NAME,
    REMAP,
    SEP,
    anonymous_name,
    canonicalize_name,
    get_ros_namespace,
    is_global,
    is_legal_base_name,
    is_legal_name,
    is_private,
    load_mappings,
    make_caller_id,
    make_global_ns,
    namespace,
    ns_join,
    resolve_name,
)

__all__ = [
    "ANYTYPE",
    "GLOBALNS",
    "PRIV_NAME",
    "PRN_SEPARATOR",
    "REMAP",
    "SEP",
    "TYPE_SEPARATOR",
    "anonymous_name",
    "canonicalize_name",
    "get_ros_namespace",
    "is_global",
    "is_legal_base_name",
    "is_legal_name",
    "is_legal_resource_base_name",
    "is_legal_resource_name",
    "is_private",
    "load_mappings",
    "make_caller_id",
    "make_global_ns",
    "namespace",
    "ns_join",
    "package_resource_name",
    "resolve_name",
    "resource_name",
    "resource_name_base",
    "resource_name_package",
]

PRN_SEPARATOR = TYPE_SEPARATOR = "/"


def resource_name(res_pkg_name: str, name: str, my_pkg: str | None = None) -> str:
    """Return ``package/name``, or the name alone in the package itself."""
    return name if res_pkg_name == my_pkg else res_pkg_name + PRN_SEPARATOR + name


def resource_name_base(name: str) -> str:
    """Return the name without its package."""
    return name.rpartition(PRN_SEPARATOR)[2]


def resource_name_package(name: str) -> str | None:
    """Return the package of a name, or None."""
    return name.partition(PRN_SEPARATOR)[0] if PRN_SEPARATOR in name else None


def package_resource_name(name: str) -> tuple[str, str]:
    """Return (package, name); the package is empty if the name has none. Raise ValueError on two slashes."""
    if PRN_SEPARATOR not in name:
        return "", name
    if name.count(PRN_SEPARATOR) > 1:
        raise ValueError(f"invalid name [{name}]")
    package, _, base = name.rpartition(PRN_SEPARATOR)
    return package, base


def is_legal_resource_name(name: str) -> bool:
    """Return whether a name is one of a resource, with or without its package."""
    return name is not None and bool(re.match(r"^[A-Za-z][\w/]*\Z", name, re.ASCII)) and "//" not in name


def is_legal_resource_base_name(name: str) -> bool:
    """Return whether a name is one of a resource without its package."""
    return name is not None and bool(re.match(r"^[A-Za-z]\w*\Z", name, re.ASCII))
