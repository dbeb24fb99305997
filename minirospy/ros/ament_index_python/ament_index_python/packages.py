"""Package paths, with ROS 2's function names. Source: https://github.com/ament/ament_index (ament_index_python)."""

from __future__ import annotations

from pathlib import Path

from minirospy.base.errors import NotFoundError
from minirospy.workspace.packages import Packages

__all__ = [
    "PackageNotFoundError",
    "get_package_prefix",
    "get_package_share_directory",
    "get_package_share_path",
    "get_packages_with_prefixes",
]


class PackageNotFoundError(KeyError):
    """Raised if the package is neither in ROS_PACKAGE_PATH nor part of minirospy."""

    def __str__(self) -> str:
        return str(self.args[0])


def get_package_share_directory(package_name: str, print_warning: bool = True) -> str:
    """Return a package's folder. Raise PackageNotFoundError if there is no such package."""
    try:
        return str(Packages().find(package_name))
    except NotFoundError as error:
        near = f"; did you mean {' or '.join(error.nearest)}?" if error.nearest else ""
        raise PackageNotFoundError(f"resource not found: {package_name}{near}") from error


def get_package_share_path(package_name: str, print_warning: bool = True) -> Path:
    """Return a package's folder as a Path. Raise PackageNotFoundError if there is no such package."""
    return Path(get_package_share_directory(package_name))


def get_package_prefix(package_name: str) -> str:
    """Return a package's folder, which in ROS 1 takes the place of the install prefix.

    Raise PackageNotFoundError if there is no such package.
    """
    return get_package_share_directory(package_name)


def get_packages_with_prefixes() -> dict[str, str]:
    """Return all packages with their folders."""
    return {name: str(folder) for name, folder in Packages().folders().items()}
