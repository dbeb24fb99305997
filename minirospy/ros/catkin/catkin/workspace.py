"""catkin.workspace: finds the sourced workspaces and their source folders."""

from __future__ import annotations

import os
from pathlib import Path

__all__ = ["CATKIN_MARKER_FILE", "get_source_paths", "get_workspaces"]

CATKIN_MARKER_FILE = ".catkin"


def get_workspaces() -> list[str]:
    """Return the catkin devel and install folders in CMAKE_PREFIX_PATH."""
    folders = os.environ.get("CMAKE_PREFIX_PATH", "").split(os.pathsep)
    return [folder for folder in folders if folder and Path(folder, CATKIN_MARKER_FILE).is_file()]


def get_source_paths(workspace: str) -> list[str]:
    """Return a devel folder's source folders; return [] for an install folder.

    Raise ValueError if ``workspace`` is not a catkin workspace.
    """
    marker = Path(workspace, CATKIN_MARKER_FILE)
    if not marker.is_file():
        raise ValueError(f'Not a catkin workspace: "{workspace}", missing file {marker}')
    return [folder for folder in marker.read_text(encoding="utf-8").strip().split(";") if folder]
