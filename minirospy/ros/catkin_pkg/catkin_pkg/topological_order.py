"""catkin_pkg.topological_order: packages in build order. Source: http://docs.ros.org/en/independent/api/catkin_pkg/."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

from minirospy.ros.catkin_pkg.catkin_pkg.package import Package
from minirospy.ros.catkin_pkg.catkin_pkg.packages import find_packages as find_packages
from minirospy.workspace.build_order import build_order
from minirospy.workspace.dependencies import CircularDependencyError
from minirospy.workspace.manifest import read_manifest

__all__ = ["topological_order", "topological_order_packages"]


def topological_order(
    root_dir: str,
    whitelisted: Collection[str] | None = None,
    blacklisted: Collection[str] | None = None,
    underlay_workspaces: Sequence[str] | None = None,
) -> list[tuple[str | None, Package | str]]:
    """Return (relative folder, package) for each package below a folder, dependencies first.

    If there is a dependency cycle, the last entry is (None, names). Raise the errors that find_packages raises.
    """
    return topological_order_packages(find_packages(root_dir), whitelisted, blacklisted)


def topological_order_packages(
    packages: Mapping[str, Package],
    whitelisted: Collection[str] | None = None,
    blacklisted: Collection[str] | None = None,
    underlay_packages: Mapping[str, Package] | None = None,
) -> list[tuple[str | None, Package | str]]:
    """Return (relative folder, package) for each package, dependencies first. See :func:`topological_order`."""
    by_name = {package.name: (path, package) for path, package in packages.items()}
    manifests = {
        name: read_manifest(Path(package.filename or path)) for name, (path, package) in by_name.items()
    }
    try:
        names = build_order(manifests)
    except CircularDependencyError as error:
        return [(None, ", ".join(sorted(set(error.circle))))]
    return [
        by_name[name]
        for name in names
        if (not whitelisted or name in whitelisted) and name not in (blacklisted or ())
    ]
