"""roslib's functions for packages, implemented with rospkg; `import roslib` re-exports them.

Source: http://wiki.ros.org/roslib, http://docs.ros.org/api/roslib/html/python/.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from minirospy.ros.rospkg.rospkg.common import MANIFEST_FILE, PACKAGE_FILE, ResourceNotFound
from minirospy.ros.rospkg.rospkg.rospack import RosPack, get_package_name
from minirospy.workspace.packages import package_name

__all__ = [
    "MANIFEST_FILE",
    "PACKAGE_FILE",
    "ROS_PACKAGE_PATH",
    "ROS_ROOT",
    "SRC_DIR",
    "InvalidROSPkgException",
    "MultipleNodesException",
    "ROSPkgException",
    "_find_resource",
    "_get_pkg_subdir_by_dir",
    "find_node",
    "find_resource",
    "get_dir_pkg",
    "get_pkg_dir",
    "get_pkg_subdir",
    "list_pkgs_by_path",
    "resource_file",
]

SRC_DIR = "src"
ROS_ROOT = "ROS_ROOT"
ROS_PACKAGE_PATH = "ROS_PACKAGE_PATH"


class ROSPkgException(Exception):
    """Raised if a package cannot be used."""


class InvalidROSPkgException(ROSPkgException):
    """Raised if there is no package with this name."""


class MultipleNodesException(ROSPkgException):
    """Raised if the package has several nodes with this name."""


def get_pkg_dir(
    package: str, required: bool = True, ros_root: str | None = None, ros_package_path: str | None = None
) -> str | None:
    """Return a package's folder.

    If the package does not exist, raise InvalidROSPkgException if ``required``, else return None.
    """
    paths = [path for path in (ros_package_path or "").split(os.pathsep) if path]
    rospack = RosPack([*paths, *RosPack().get_ros_paths()])
    try:
        return rospack.get_path(package)
    except ResourceNotFound as error:
        if required:
            raise InvalidROSPkgException(f"Cannot locate installation of package {error}") from error
        return None


def get_dir_pkg(d: str) -> tuple[str | None, str | None]:
    """Return (folder, name) of the package that contains a path, or (None, None)."""
    name = get_package_name(d)
    place = Path(d).absolute()
    folder = next((each for each in (place, *place.parents) if package_name(each) is not None), None)
    return (str(folder), name) if folder else (None, None)


def get_pkg_subdir(
    package: str, subdir: str, required: bool = True, env: dict[str, str] | None = None
) -> str | None:
    """Return a folder in a package.

    If the folder is missing, create it if ``required``, else return None. Raise InvalidROSPkgException if the package does not
    exist.
    """
    folder = get_pkg_dir(package, required)
    if folder is None:
        return None
    path = Path(folder, subdir)
    if required:
        path.mkdir(parents=True, exist_ok=True)
    return str(path) if path.is_dir() else None


def resource_file(package: str, subdir: str, resource_name: str) -> str:
    """Return the path of a file in a package's folder; the file need not exist.

    Raise InvalidROSPkgException if the package does not exist.
    """
    return os.path.join(str(get_pkg_dir(package)), subdir, resource_name)


def find_node(pkg: str, node_type: str, rospack: RosPack | None = None) -> list[str]:
    """Return the programs with this name in a package. Raise ResourceNotFound if the package does not exist."""
    return find_resource(pkg, node_type, _is_program, rospack)


def find_resource(
    pkg: str,
    resource_name: str,
    filter_fn: Callable[[str], bool] | None = None,
    rospack: RosPack | None = None,
) -> list[str]:
    """Return the files with this name in a package and in its workspace's build output.

    Raise ResourceNotFound if the package does not exist.
    """
    folder = Path((rospack or RosPack()).get_path(pkg))
    if len(Path(resource_name).parts) > 1:
        found: Iterator[Path] = filter(Path.is_file, [folder / resource_name])
    else:
        found = _files(folder, pkg, resource_name)
    return [str(path) for path in found if filter_fn is None or filter_fn(str(path))]


def list_pkgs_by_path(
    path: str,
    packages: list[str] | None = None,
    cache: dict[str, str] | None = None,
    env: dict[str, str] | None = None,
) -> list[str]:
    """Append the names of the packages below a folder to ``packages``; return ``packages``."""
    found = [] if packages is None else packages
    found += [name for name in RosPack([path]).list() if name not in found]
    return found


def _files(folder: Path, package: str, name: str) -> Iterator[Path]:
    for prefix in os.environ.get("CMAKE_PREFIX_PATH", "").split(os.pathsep):
        for built in (Path(prefix, "lib", package, name), Path(prefix, "share", package, name)):
            if prefix and built.is_file():
                yield built
    yield from map(Path, _find_resource(str(folder), name))


def _find_resource(d: str, resource_name: str, filter_fn: Callable[[str], bool] | None = None) -> list[str]:
    """Return the files with this name below a folder, following links and skipping folders that start with a dot."""
    # On Windows, programs may be named without suffix, and case is ignored.
    suffixes = ("", ".exe", ".bat", ".py") if os.name == "nt" else ("",)
    wanted = [os.path.normcase(resource_name + suffix) for suffix in suffixes]
    found, seen = [], set()

    for path, folders, names in os.walk(d, followlinks=True):
        real = os.path.realpath(path)
        if real in seen:
            # Do not follow a link to a parent folder, because the search would never end.
            folders.clear()
            continue
        seen.add(real)
        folders[:] = sorted(each for each in folders if not each.startswith("."))
        there = {os.path.normcase(name) for name in names}
        found += [os.path.abspath(os.path.join(path, name)) for name in wanted if name in there]
    return [each for each in found if filter_fn is None or filter_fn(each)]


def _get_pkg_subdir_by_dir(
    package_dir: str, subdir: str, required: bool = True, env: Mapping[str, str] | None = None
) -> str:
    """Return a subfolder of the package at a path. If ``required``, create it if it is missing.

    Raise OSError if the folder cannot be created.
    """
    path = os.path.join(package_dir, subdir)
    if required:
        os.makedirs(path, exist_ok=True)
    return path


def _is_program(path: str) -> bool:
    return path.endswith(".py") or os.access(path, os.X_OK)
