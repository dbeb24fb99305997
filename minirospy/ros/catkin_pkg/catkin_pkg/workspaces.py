"""catkin_pkg.workspaces: finds the sourced workspaces. Source: http://docs.ros.org/en/independent/api/catkin_pkg/html/."""

from __future__ import annotations

import os
from collections.abc import Sequence

__all__ = ["CATKIN_WORKSPACE_MARKER_FILE", "ensure_workspace_marker", "get_spaces", "order_paths"]

CATKIN_WORKSPACE_MARKER_FILE = ".catkin_workspace"
_DEVEL_MARKER = ".catkin"


def get_spaces(paths: Sequence[str] | None = None) -> list[str]:
    """Return the package folders of the workspaces ``paths``, by default those in CMAKE_PREFIX_PATH."""
    if paths is None:
        text = os.environ.get("CMAKE_PREFIX_PATH", "")
        paths = [path for path in text.split(os.pathsep) if path]
    spaces = []
    for path in paths:
        marker = os.path.join(path, _DEVEL_MARKER)
        if not os.path.isfile(marker):
            continue
        with open(marker, encoding="utf-8") as file:
            text = file.read()
        spaces += [os.path.join(path, "share"), *(text.split(";") if text else [])]
    return spaces


def order_paths(paths_to_order: Sequence[str], prefix_paths: Sequence[str]) -> list[str]:
    """Sort the paths in the order of the prefixes that contain them; paths outside all prefixes come last."""
    groups: dict[str, list[str]] = {prefix: [] for prefix in prefix_paths}
    others = []
    for path in paths_to_order:
        for prefix, group in groups.items():
            if path == prefix or path.startswith(prefix + os.sep):
                group.append(path)
                break
        else:
            others.append(path)
    return [path for group in (*groups.values(), others) for path in group]


def ensure_workspace_marker(base_path: str) -> None:
    """Write the file that marks a folder as a workspace, if the file does not exist."""
    marker = os.path.join(base_path, CATKIN_WORKSPACE_MARKER_FILE)
    if not os.path.exists(marker):
        with open(marker, "a", encoding="utf-8") as file:
            file.write(
                "# This file currently only serves to mark the location of a catkin workspace for tool integration\n"
            )
