"""Links to the page's views, and the fields in rqt_plot's arguments. Pure.

A view and its settings are in the link's fragment, which browsers do not send, so that the token in it is not logged.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from urllib.parse import quote, urlencode

from minirospy.base.errors import UsageError

__all__ = ["LAYOUTS", "VIEWS", "link", "plotted_fields"]

VIEWS = (
    "overview",
    "topics",
    "console",
    "plot",
    "graph",
    "image",
    "3d",
    "simulation",
    "tf",
    "board",
    "turtlesim",
    "teleop",
    "publish",
    "services",
    "actions",
    "parameters",
    "reconfigure",
    "nodes",
    "launch",
    "bag",
    "joints",
    "controllers",
    "trajectory",
    "smach",
    "diagnostics",
    "class",
    "panels",
    "layout",
)
"""The views' names in links, in the order of their tabs; the page has one module for each view."""

LAYOUTS = ("workshop", "console", "rviz", "teleop", "classroom")
"""Layouts built into the page, each with several views next to each other."""


def link(
    host: str,
    port: int,
    view: str,
    fields: Mapping[str, Iterable[str]] | None = None,
    *,
    token: str = "",
    code: str = "",
    encrypted: bool = False,
) -> str:
    """Return the URL of a view. ``fields`` contains the view's settings; for ``code``, see codes.py."""
    words = [(name, value) for name, values in (fields or {}).items() for value in values]
    words += [(name, value) for name, value in (("token", token), ("code", code)) if value]
    query = f"?{urlencode(words, quote_via=quote, safe='/[]:')}" if words else ""
    scheme = "https" if encrypted else "http"
    name = f"[{host}]" if ":" in host else host
    return f"{scheme}://{name}:{port}/#/{view}{query}"


_IN_BAG = re.compile(r".+?\.(bag|mcap):/")


def plotted_fields(words: Iterable[str]) -> list[str]:
    """Return the paths in rqt_plot's arguments: /a/x and /b/y for ``/a/x,/b/y``, /pose/x and /pose/y for ``/pose/x:y``.

    A path in a bag, ``run.bag:/pose/x``, remains as it is. Raise UsageError if an argument is not a path.
    """
    found: list[str] = []
    for word in (part for each in words for part in each.split(",") if part):
        if _IN_BAG.match(word):
            found.append(word)
            continue
        # A colon within brackets belongs to a slice.
        head, *others = _split_colons(word)
        base = head.rpartition("/")[0]
        if not base and not head.startswith("/"):
            raise UsageError(f"'{word}' is not a topic and a field, as /turtle1/pose/x")
        if others and not base:
            raise UsageError(f"'{word}' has no field in front of its colon: write /topic/field:field")
        found.append(head if head.startswith("/") else f"/{head}")
        found += [f"{base if base.startswith('/') else f'/{base}'}/{field}" for field in others if field]
    return found


def _split_colons(word: str) -> list[str]:
    parts = [""]
    depth = 0
    for character in word:
        depth += (character == "[") - (character == "]")
        if character == ":" and not depth:
            parts.append("")
        else:
            parts[-1] += character
    return parts
