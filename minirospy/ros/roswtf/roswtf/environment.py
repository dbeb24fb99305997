"""roswtf.environment: the checks for paths and URIs that roswtf plugins use."""

from __future__ import annotations

import os
import socket
import stat
from collections.abc import Mapping
from typing import Protocol
from urllib.parse import urlparse

from minirospy.ros.roswtf.roswtf.rules import Context, Rule, error_rule, warning_rule

__all__ = [
    "_writable_dir_check",
    "environment_errors",
    "environment_warnings",
    "invalid_url",
    "is_executable",
    "path_check",
    "paths",
    "pythonpath_check",
    "ros_home_check",
    "ros_log_dir_check",
    "ros_master_uri_hostname",
    "ros_root_check",
    "ros_test_results_dir_check",
    "rosconsole_config_file_check",
    "wtf_check_environment",
]


class _Context(Context, Protocol):
    """A context with the environment variables."""

    env: Mapping[str, str]
    pythonpath: str | None
    ros_master_uri: str
    ros_root: str


def paths(path: str | None) -> list[str]:
    """Return the folders listed in the value of a variable such as PATH."""
    return path.split(os.pathsep) if path else []


def is_executable(path: str) -> int:
    """Return a file's execute permission bits, or 0 if there are none. Raise OSError if the file does not exist."""
    mode = os.stat(path)[stat.ST_MODE]
    return mode & (stat.S_IXUSR | stat.S_IXGRP | stat.S_IXOTH)


def invalid_url(url: str | None) -> str | None:
    """Return the error in a master URI, or None if it is valid."""
    if not url:
        return None
    scheme, _, rest = url.partition("://")
    if scheme != "http" or not rest:
        return "protocol is not 'http'"
    place = urlparse(url).netloc.rsplit("@", 1)[-1]
    _, colon, port = place.rpartition(":")
    if not colon:
        return "port number is missing"
    try:
        int(port)
    except ValueError:
        return f"port number [{port}] is invalid"
    return None


def ros_root_check(ctx: _Context, ros_root: str | None = None) -> str | None:
    """Return the error in ROS_ROOT, or None if it is valid."""
    path = ctx.ros_root if ros_root is None else ros_root
    if os.path.basename(os.path.normpath(path)) in ("ros", "rosbuild"):
        return None
    return f"ROS_ROOT [{path}] must end in directory named 'ros'"


def _writable_dir_check(ctx: _Context, path: str | None, name: str) -> str | None:
    """Return why ROS cannot write to a folder, or None if it can."""
    if path is None:
        return None
    if os.path.isfile(path):
        return f"{name} [{path}] must point to a directory, not a file"
    return None if os.access(path, os.W_OK) else f"{name} [{path}] is not writable"


def ros_home_check(ctx: _Context) -> str | None:
    """Return the error in ROS_HOME, or None if it is valid."""
    return _writable_dir_check(ctx, ctx.env.get("ROS_HOME"), "ROS_HOME")


def ros_log_dir_check(ctx: _Context) -> str | None:
    """Return the error in ROS_LOG_DIR, or None if it is valid."""
    return _writable_dir_check(ctx, ctx.env.get("ROS_LOG_DIR"), "ROS_LOG_DIR")


def ros_test_results_dir_check(ctx: _Context) -> str | None:
    """Return the error in ROS_TEST_RESULTS_DIR, or None if it is valid."""
    return _writable_dir_check(ctx, ctx.env.get("ROS_TEST_RESULTS_DIR"), "ROS_TEST_RESULTS_DIR")


def pythonpath_check(ctx: _Context) -> str | None:
    """Return an error if PYTHONPATH contains several roslib folders, else None."""
    if len({path for path in paths(ctx.pythonpath) if "roslib" in path.split(os.sep)}) > 1:
        return "Multiple roslib directories in PYTHONPATH (there should only be one)"
    return None


def rosconsole_config_file_check(ctx: _Context) -> bool | None:
    """Return whether ROSCONSOLE_CONFIG_FILE names a missing file, or None if it is not set."""
    file = ctx.env.get("ROSCONSOLE_CONFIG_FILE")
    return None if file is None else not os.path.isfile(file)


def path_check(ctx: _Context) -> bool | None:
    """Return True if ROS is installed system-wide and PATH lists /usr/bin before ROS_ROOT, else None."""
    path = ctx.env["PATH"]
    system, ros = path.find("/usr/bin"), path.find(ctx.ros_root)
    return True if os.path.exists("/usr/lib/ros/") and 0 <= system < ros else None


def ros_master_uri_hostname(ctx: _Context) -> str | None:
    """Return an error if the host in ROS_MASTER_URI is unknown, else None. Other rules check the rest of the URI."""
    host, colon, port = urlparse(ctx.ros_master_uri).netloc.partition(":")
    if not colon or ":" in port:
        return None
    try:
        socket.getaddrinfo(host, 0, 0, 0, socket.IPPROTO_TCP)
    except socket.gaierror:
        return f"Unknown host {host}"
    return None


def _not_folders(path: str | None) -> list[str]:
    return [each for each in paths(path) if each and not os.path.isdir(each)]


def _not_package_folders(path: str | None) -> list[str]:
    # Ignore missing folders named share or stacks: a catkin workspace lists them even if they do not exist.
    return [
        each
        for each in _not_folders(path)
        if not (
            os.path.basename(each) == "stacks"
            and os.path.exists(os.path.join(os.path.dirname(each), ".catkin"))
        )
    ]


environment_warnings: list[Rule] = [
    (
        path_check,
        "PATH has /usr/bin set before ROS_ROOT/bin, which can cause problems as there is system install of ROS on this "
        "machine. You may wish to put ROS_ROOT/bin first",
    ),
    (
        lambda ctx: ctx.ros_package_path is None,
        "ROS_PACKAGE_PATH is not set. This is not required, but is unusual",
    ),
    (
        lambda ctx: not paths(ctx.ros_package_path),
        "ROS_PACKAGE_PATH is empty. This is not required, but is unusual",
    ),
    (lambda ctx: not ctx.ros_master_uri, "ROS_MASTER_URI is empty. This is not required, but is unusual"),
    (ros_master_uri_hostname, "Cannot resolve hostname in ROS_MASTER_URI [%(ros_master_uri)s]"),
    (rosconsole_config_file_check, "ROS_CONSOLE_CONFIG_FILE does not point to an existing file"),
]
environment_errors: list[Rule] = [
    (lambda ctx: not os.path.isdir(ctx.ros_root), "ROS_ROOT [%(ros_root)s] does not point to a directory"),
    (ros_root_check, "ROS_ROOT is invalid: "),
    (
        lambda ctx: [each for each in paths(ctx.ros_package_path) if os.path.isfile(each)],
        "Path(s) in ROS_PACKAGE_PATH [%(ros_package_path)s] points to a file instead of a directory: ",
    ),
    (
        lambda ctx: _not_package_folders(ctx.ros_package_path),
        "Not all paths in ROS_PACKAGE_PATH [%(ros_package_path)s] point to an existing directory: ",
    ),
    (
        lambda ctx: _not_folders(ctx.pythonpath),
        "Not all paths in PYTHONPATH [%(pythonpath)s] point to a directory: ",
    ),
    (pythonpath_check, "PYTHONPATH [%(pythonpath)s] is invalid: "),
    (ros_home_check, "ROS_HOME is invalid: "),
    (ros_log_dir_check, "ROS_LOG_DIR is invalid: "),
    (ros_test_results_dir_check, "ROS_TEST_RESULTS_DIR is invalid: "),
    (lambda ctx: invalid_url(ctx.ros_master_uri), "ROS_MASTER_URI [%(ros_master_uri)s] is not a valid URL: "),
]


def wtf_check_environment(ctx: _Context) -> None:
    """Check a context's environment variables; add the errors and warnings to the context."""
    for rule in environment_warnings:
        warning_rule(rule, rule[0](ctx), ctx)
    for rule in environment_errors:
        error_rule(rule, rule[0](ctx), ctx)
