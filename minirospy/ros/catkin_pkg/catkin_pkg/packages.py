"""catkin_pkg.packages: finds the packages below a folder. Source: http://docs.ros.org/en/independent/api/catkin_pkg/html/."""

from __future__ import annotations

import os
from collections.abc import Collection, Sequence

from minirospy.ros.catkin_pkg.catkin_pkg.package import (
    PACKAGE_MANIFEST_FILENAME,
    Package,
    parse_package,
)

__all__ = [
    "DEFAULT_IGNORE_MARKERS",
    "PACKAGE_MANIFEST_FILENAME",
    "find_package_paths",
    "find_packages",
    "find_packages_allowing_duplicates",
    "verify_equal_package_versions",
]

DEFAULT_IGNORE_MARKERS = {"AMENT_IGNORE", "CATKIN_IGNORE", "COLCON_IGNORE"}


def find_package_paths(
    basepath: str,
    exclude_paths: Sequence[str] | None = None,
    exclude_subspaces: bool = False,
    ignore_markers: Collection[str] = DEFAULT_IGNORE_MARKERS,
) -> list[str]:
    """Return the packages' folders, relative to ``basepath``. Ignore nested packages.

    ``exclude_subspaces``: skip folders that a build has created, which contain a file ``.catkin``.
    """
    paths = []
    excluded = {os.path.realpath(path) for path in exclude_paths or ()}
    for folder, folders, files in os.walk(basepath, followlinks=True):
        names = {*folders, *files}
        is_left_out = bool(names & {*ignore_markers}) or os.path.realpath(folder) in excluded
        if is_left_out or (exclude_subspaces and ".catkin" in files):
            folders.clear()
        elif PACKAGE_MANIFEST_FILENAME in files:
            paths.append(os.path.relpath(folder, basepath))
            folders.clear()
        else:
            # Keep the file system's order, as in ROS.
            folders[:] = [name for name in folders if not name.startswith(".")]
    return paths


def find_packages(
    basepath: str,
    exclude_paths: Sequence[str] | None = None,
    exclude_subspaces: bool = False,
    warnings: list[str] | None = None,
    ignore_markers: Collection[str] = DEFAULT_IGNORE_MARKERS,
) -> dict[str, Package]:
    """Return a dict of packages keyed by relative folder.

    Raise RuntimeError if two packages have the same name, InvalidPackage if a package.xml is invalid.
    """
    packages = find_packages_allowing_duplicates(
        basepath, exclude_paths, exclude_subspaces, warnings, ignore_markers
    )
    by_name: dict[str, list[str]] = {}
    for path, package in packages.items():
        by_name.setdefault(package.name, []).append(path)
    duplicates = [
        f'Multiple packages found with the same name "{name}":'
        + "".join(f"\n- {path}" for path in sorted(paths))
        for name, paths in by_name.items()
        if len(paths) > 1
    ]
    if duplicates:
        raise RuntimeError("\n".join(duplicates))
    return packages


def find_packages_allowing_duplicates(
    basepath: str,
    exclude_paths: Sequence[str] | None = None,
    exclude_subspaces: bool = False,
    warnings: list[str] | None = None,
    ignore_markers: Collection[str] = DEFAULT_IGNORE_MARKERS,
) -> dict[str, Package]:
    """Return a dict of packages keyed by relative folder. Raise InvalidPackage if a package.xml is invalid."""
    paths = find_package_paths(basepath, exclude_paths, exclude_subspaces, ignore_markers)
    files = {path: os.path.join(basepath, path, PACKAGE_MANIFEST_FILENAME) for path in paths}
    return {path: parse_package(file, warnings) for path, file in files.items()}


def verify_equal_package_versions(packages: Sequence[Package]) -> str | None:
    """Return the packages' common version, or None if there are no packages. Raise RuntimeError if the versions differ."""
    version, first = None, None
    for package in packages:
        if version is None or first is None:
            version, first = package.version, package
        elif package.version != version:
            raise RuntimeError(
                f"Two packages have different version numbers ({package.version} != {version}):\n"
                f"- {package.filename}\n- {first.filename}"
            )
    return version
