"""The launch files in packages. A page identifies a file by its package and its path in the package."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from minirospy.base.errors import NotFoundError
from minirospy.workspace.packages import Packages

__all__ = ["LaunchFile", "LaunchFiles"]

_SUFFIXES = (".launch", ".launch.xml")
_MAX_DEPTH = 5
_MOST = 5000


class LaunchFile(NamedTuple):
    """A launch file: its package, and its path in the package, with forward slashes."""

    package: str
    path: str


class LaunchFiles:
    """Finds the launch files in packages. The methods block, because they read directories."""

    def __init__(self, packages: Packages) -> None:
        self._packages = packages
        self._found: dict[LaunchFile, Path] = {}

    def scan(self) -> list[LaunchFile]:
        """Return all launch files, sorted."""
        found: dict[LaunchFile, Path] = {}
        folders = self._packages.folders()
        own = set(folders.values())
        for package, folder in folders.items():
            for path in _launch_files(folder, own, _MAX_DEPTH):
                found[LaunchFile(package, path.relative_to(folder).as_posix())] = path
                if len(found) >= _MOST:
                    break
        self._found = found
        return sorted(found)

    def path_of(self, file: LaunchFile) -> Path:
        """Return the path of a launch file.

        Raise NotFoundError if :meth:`scan` has not found it, because such files must not be started.
        """
        if not self._found:
            self.scan()
        try:
            return self._found[file]
        except KeyError:
            known = [each.path for each in self._found if each.package == file.package]
            name = f"{file.package}/{file.path}"[:200]
            raise NotFoundError("launch file", name, known, "it is not in a package that is found") from None


def _launch_files(folder: Path, packages: set[Path], depth: int) -> Iterator[Path]:
    """Yield the launch files of a package, but not of packages nested in it."""
    try:
        entries = sorted(os.scandir(folder), key=lambda entry: entry.name)
    except OSError:
        return
    for entry in entries:
        path = Path(entry.path)
        if entry.name.startswith("."):
            continue
        try:
            is_folder = entry.is_dir(follow_symlinks=False)
            is_file = entry.is_file()
        except OSError:
            continue
        if is_folder and depth and path not in packages:
            yield from _launch_files(path, packages, depth - 1)
        elif is_file and entry.name.endswith(_SUFFIXES):
            yield path
