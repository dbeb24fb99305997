"""genmsg.command_line: the search path of message generators. Source: http://wiki.ros.org/genmsg."""

from __future__ import annotations

from collections.abc import Iterable

__all__ = ["includepath_to_dict"]


def includepath_to_dict(includepath: Iterable[str] | None) -> dict[str, list[str]]:
    """Convert the ``package:folder`` values of option ``-I`` to a dict of folder lists keyed by package.

    The key is '' for a value without a package.
    """
    found: dict[str, list[str]] = {}
    for value in includepath or ():
        package, colon, folder = value.partition(":")
        if not colon:
            package, folder = "", value
        if folder:
            found.setdefault(package, []).append(folder)
    return found
