"""roslib.stacks: rosbuild's stacks, which are folders with a stack.xml; catkin uses metapackages instead.

Source: http://wiki.ros.org/Stacks.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence

from minirospy.ros.roslib.roslib.manifest import folders_with
from minirospy.ros.roslib.roslib.packages import ROS_PACKAGE_PATH, ROS_ROOT, get_pkg_dir
from minirospy.ros.rospkg.rospkg.common import MANIFEST_FILE, STACK_FILE
from minirospy.ros.rospkg.rospkg.rospack import RosPack, RosStack
from minirospy.ros.rospkg.rospkg.rospack import expand_to_packages as _expand

__all__ = [
    "ROS_PACKAGE_PATH",
    "ROS_ROOT",
    "ROS_STACK",
    "STACK_FILE",
    "InvalidROSStackException",
    "ROSStackException",
    "_get_cmake_version",
    "expand_to_packages",
    "get_stack_dir",
    "get_stack_version",
    "get_stack_version_by_dir",
    "list_stacks",
    "list_stacks_by_path",
    "stack_of",
]

ROS_STACK = "ros"


class ROSStackException(Exception):
    """Raised if a stack cannot be used."""


class InvalidROSStackException(ROSStackException):
    """Raised if there is no stack with this name."""


def list_stacks_by_path(
    path: str, stacks: list[str] | None = None, cache: dict[str, str] | None = None
) -> list[str]:
    """Append the stacks below a folder to ``stacks`` and return ``stacks``; store the stacks' folders in ``cache``."""
    found = [] if stacks is None else stacks
    for folder in folders_with(STACK_FILE, path):
        if (name := os.path.basename(folder)) not in found:
            found.append(name)
            if cache is not None:
                cache[name] = folder
    return found


def list_stacks(env: Mapping[str, str] | None = None) -> list[str]:
    """Return the stacks and metapackages."""
    return sorted({*_stacks(env), *RosStack(_paths(env)).list()})


def get_stack_dir(stack: str, env: Mapping[str, str] | None = None) -> str:
    """Return the folder of a stack or metapackage. Raise InvalidROSStackException if neither exists."""
    folders = _stacks(env)
    if stack in folders:
        return folders[stack]
    metapackages = RosStack(_paths(env))
    if stack not in metapackages.list():
        raise InvalidROSStackException(stack)
    return metapackages.get_path(stack)


def get_stack_version(stack: str, env: Mapping[str, str] | None = None) -> str | None:
    """Return a metapackage's version, or None for a rosbuild stack.

    Raise ResourceNotFound if neither exists.
    """
    return None if stack in _stacks(env) else RosStack(_paths(env)).get_stack_version(stack)


def stack_of(pkg: str, env: Mapping[str, str] | None = None) -> str | None:
    """Return the stack that contains a package, or None.

    Raise InvalidROSPkgException if there is no such package.
    """
    folder = _packages(env).get(pkg) or str(get_pkg_dir(pkg))
    while os.path.dirname(folder) != folder:
        if os.path.exists(os.path.join(folder, STACK_FILE)):
            return os.path.basename(folder)
        folder = os.path.dirname(folder)
    return None


def expand_to_packages(
    names: Sequence[str], env: Mapping[str, str] | None = None
) -> tuple[list[str], list[str]]:
    """Replace stacks and metapackages with their packages; return (packages, unknown names)."""
    stacks, known = _stacks(env), _packages(env)
    packages: list[str] = []
    unknown = []
    for name in names:
        if name in known:
            packages.append(name)
        elif name in stacks:
            packages += map(os.path.basename, folders_with(MANIFEST_FILE, stacks[name]))
        else:
            found, missing = _expand([name], RosPack(_paths(env)), RosStack(_paths(env)))
            packages += found
            unknown += missing
    return packages, unknown


def _paths(env: Mapping[str, str] | None) -> list[str] | None:
    """Return the folders to search according to ``env``. None selects this process's environment."""
    return None if env is None else _folders(env)


def _folders(env: Mapping[str, str] | None) -> list[str]:
    path = (os.environ if env is None else env).get("ROS_PACKAGE_PATH", "")
    return [each for each in path.split(os.pathsep) if each]


def _stacks(env: Mapping[str, str] | None) -> dict[str, str]:
    found: dict[str, str] = {}
    for path in _folders(env):
        list_stacks_by_path(path, list(found), found)
    return found


def _packages(env: Mapping[str, str] | None) -> dict[str, str]:
    """Return the folders of all rosbuild packages."""
    folders = (folder for path in _folders(env) for folder in folders_with(MANIFEST_FILE, path))
    return {os.path.basename(folder): folder for folder in folders}


def get_stack_version_by_dir(stack_dir: str) -> str | None:
    """Return a stack's version from its stack.xml or CMakeLists.txt, or None if neither contains one."""
    from minirospy.ros.rospkg.rospkg.manifest import parse_manifest_file

    if os.path.isfile(os.path.join(stack_dir, STACK_FILE)):
        version = parse_manifest_file(stack_dir, STACK_FILE).version
        if version:
            return str(version)
    path = os.path.join(stack_dir, "CMakeLists.txt")
    if not os.path.isfile(path):
        return None
    with open(path, encoding="utf-8") as stream:
        return _get_cmake_version(stream.read())


def _get_cmake_version(text: str) -> str | None:
    """Return the version in the `rosbuild_make_distribution` of a CMakeLists.txt, or None if there is none."""
    for line in text.split("\n"):
        if line.strip().startswith("rosbuild_make_distribution"):
            return line.partition("(")[2].partition(")")[0] or None
    return None
