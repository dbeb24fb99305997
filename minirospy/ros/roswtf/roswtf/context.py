"""roswtf.context: the environment, packages and launch files that roswtf's checks and plugins examine."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

from minirospy.ros.rosgraph.rosgraph.rosenv import get_master_uri
from minirospy.ros.roslaunch.roslaunch.config import load_config_default
from minirospy.ros.roslaunch.roslaunch.core import RLException
from minirospy.ros.roslaunch.roslaunch.depends import RoslaunchDepsException, roslaunch_deps
from minirospy.ros.rospkg.rospkg.common import ResourceNotFound
from minirospy.ros.rospkg.rospkg.environment import ROS_PACKAGE_PATH, ROS_ROOT, get_ros_paths
from minirospy.ros.rospkg.rospkg.manifest import InvalidManifest
from minirospy.ros.rospkg.rospkg.rospack import RosPack, RosStack
from minirospy.ros.roswtf.roswtf.model import WtfError

__all__ = ["WtfContext", "WtfException"]

_NAMES = [
    *("pkg", "pkg_dir", "pkgs", "stack", "stack_dir", "stacks", "manifest_file", "manifest"),
    *("env", "ros_root", "ros_package_path", "pythonpath", "ros_master_uri"),
    *("roslaunch_uris", "launch_files", "launch_file_deps", "launch_file_missing_deps"),
    *("system_state", "service_providers", "topics", "services", "nodes", "uri_node_map"),
    *("expected_edges", "actual_edges", "unconnected_subscriptions", "use_sim_time"),
    *("warnings", "errors", "rospack", "rosstack"),
]
_LISTS = ("pkgs", "stacks", "warnings", "errors")
_DEFAULT_ROOT = "/usr/share/ros"


class WtfException(Exception):
    """Raised if a context cannot be created."""


class WtfContext:
    """The data for checks to examine, and the ``warnings`` and ``errors`` they report. Unknown attributes are None."""

    __slots__ = _NAMES
    warnings: list[WtfError]
    errors: list[WtfError]
    env: Mapping[str, str]
    pythonpath: str | None
    ros_master_uri: str
    ros_root: str
    rospack: RosPack
    rosstack: RosStack

    def __init__(self) -> None:
        for name in self.__slots__:
            setattr(self, name, [] if name in _LISTS else {} if name in ("env", "uri_node_map") else None)

    def as_dictionary(self) -> dict[str, object]:
        """Return the attributes as a dict, for a rule's message."""
        return {name: getattr(self, name) for name in self.__slots__}

    @staticmethod
    def from_env(env: Mapping[str, str] | None = None) -> WtfContext:
        """Return a context with only the environment."""
        return _Filled(env).made

    @staticmethod
    def from_package(pkg: str, env: Mapping[str, str] | None = None) -> WtfContext:
        """Return a package's context. Raise WtfException if the package or a dependency does not exist."""
        filled = _Filled(env)
        filled.load_package(pkg)
        return filled.made

    @staticmethod
    def from_stack(stack: str, env: Mapping[str, str] | None = None) -> WtfContext:
        """Return a metapackage's context. Raise WtfException if the metapackage or a dependency does not exist."""
        filled = _Filled(env)
        filled.load_stack(stack)
        return filled.made

    @staticmethod
    def from_roslaunch(roslaunch_files: Sequence[str], env: Mapping[str, str] | None = None) -> WtfContext:
        """Return the context for launch files and their package. Raise WtfException if a file is invalid."""
        for file in roslaunch_files:
            try:
                load_config_default([file], None, assign_machines=False)
            except RLException as error:
                raise WtfException(f"Unable to load roslaunch file [{file}]: {error}") from error
        filled = _Filled(env)
        context: Any = filled.context
        context.launch_files = roslaunch_files
        try:
            package, context.launch_file_deps, context.launch_file_missing_deps = roslaunch_deps(
                roslaunch_files
            )
        except RoslaunchDepsException as error:
            raise WtfException(str(error)) from error
        filled.load_package(package or "None")
        return filled.made


class _Filled:
    """Builds a context: the environment, plus packages and metapackages."""

    def __init__(self, env: Mapping[str, str] | None) -> None:
        env = os.environ if env is None else env
        self.made = WtfContext()
        context: Any = self.made
        context.rospack, context.rosstack = (
            RosPack(get_ros_paths(dict(env))),
            RosStack(get_ros_paths(dict(env))),
        )
        context.env = env
        context.ros_root = env.get(ROS_ROOT, _DEFAULT_ROOT)
        context.ros_package_path = env.get(ROS_PACKAGE_PATH, _DEFAULT_ROOT)
        context.pythonpath = env.get("PYTHONPATH", "/usr/lib/python3/dist-packages/")
        context.ros_master_uri = get_master_uri()
        self.context = context

    def load_package(self, name: str) -> None:
        """Set a package's attributes, and its metapackage's if it has one."""
        context = self.context
        context.pkg = name
        try:
            context.pkgs = [name, *context.rospack.get_depends(name)]
        except ResourceNotFound as error:
            raise WtfException(f"Cannot find dependencies for package [{name}]: missing {error}") from error
        try:
            context.pkg_dir = context.rospack.get_path(name)
            context.manifest_file = os.path.join(context.pkg_dir, "manifest.xml")
            context.manifest = context.rospack.get_manifest(name)
        except ResourceNotFound as error:
            raise WtfException(f"Cannot locate manifest file for package [{name}]") from error
        except InvalidManifest as error:
            raise WtfException(f"Package [{name}] has an invalid manifest: {error}") from error
        stack = context.rospack.stack_of(name)
        if stack:
            packages = context.pkgs
            self.load_stack(stack)
            context.pkgs = packages

    def load_stack(self, name: str) -> None:
        """Set a metapackage's attributes."""
        context = self.context
        context.stack = name
        try:
            context.stacks = [name, *context.rosstack.get_depends(name, implicit=True)]
        except ResourceNotFound as error:
            raise WtfException(f"Cannot load dependencies of stack [{name}]: {error}") from error
        try:
            context.stack_dir = context.rosstack.get_path(name)
        except ResourceNotFound as error:
            raise WtfException(
                f"[{name}] appears to be a stack, but it's not on your ROS_PACKAGE_PATH"
            ) from error
        context.pkgs = context.rosstack.packages_of(name)
