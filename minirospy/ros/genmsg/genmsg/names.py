"""genmsg.names: resource names (``package/name``)."""

from __future__ import annotations

import re

__all__ = [
    "BASE_RESOURCE_NAME_LEGAL_CHARS_P",
    "PRN_SEPARATOR",
    "RESOURCE_NAME_LEGAL_CHARS_P",
    "is_legal_resource_base_name",
    "is_legal_resource_name",
    "package_resource_name",
    "resource_name",
    "resource_name_base",
    "resource_name_package",
]

PRN_SEPARATOR = "/"
RESOURCE_NAME_LEGAL_CHARS_P = re.compile(r"^[A-Za-z][\w_\/]*$")
BASE_RESOURCE_NAME_LEGAL_CHARS_P = re.compile(r"^[A-Za-z][\w_]*$")


def resource_name(res_pkg_name: str, name: str, my_pkg: str | None = None) -> str:
    """Return ``package/name``, or only the name if its package is ``my_pkg``."""
    return name if res_pkg_name == my_pkg else res_pkg_name + PRN_SEPARATOR + name


def resource_name_base(name: str) -> str:
    """Return the name without its package."""
    return name.rpartition(PRN_SEPARATOR)[2]


def resource_name_package(name: str) -> str | None:
    """Return a name's package, or None if the name has no package."""
    return name.partition(PRN_SEPARATOR)[0] if PRN_SEPARATOR in name else None


def package_resource_name(name: str) -> tuple[str, str]:
    """Return (package, name); the package is empty if the name has no package. Raise ValueError if the name has two slashes."""
    if PRN_SEPARATOR not in name:
        return "", name
    if name.count(PRN_SEPARATOR) > 1:
        raise ValueError(f"invalid name [{name}]")
    package, _, base = name.rpartition(PRN_SEPARATOR)
    return package, base


def is_legal_resource_name(name: str) -> bool:
    """Return whether a string is a valid resource name, with or without a package."""
    return name is not None and bool(re.match(r"^[A-Za-z][\w/]*\Z", name, re.ASCII)) and "//" not in name


def is_legal_resource_base_name(name: str) -> bool:
    """Return whether a string is a valid resource name without a package."""
    return name is not None and bool(re.match(r"^[A-Za-z]\w*\Z", name, re.ASCII))
