"""Provides the names in ROS's module rosunit.core."""

from __future__ import annotations

import os
import sys

from minirospy.ros.rosunit.runner.unit import (
    XML_OUTPUT_FLAG,
    XMLTestRunner,
    create_xml_runner,
    rostest_name_from_path,
    xml_results_file,
)

__all__ = [
    "XML_OUTPUT_FLAG",
    "XMLTestRunner",
    "create_xml_runner",
    "makedirs_with_parent_perms",
    "printerrlog",
    "printlog",
    "printlog_bold",
    "rostest_name_from_path",
    "xml_results_file",
]


def printlog(msg: str, *args: object) -> None:
    """Print a message from rosunit."""
    print("[ROSUNIT]" + (msg % args if args else msg))


def printlog_bold(msg: str, *args: object) -> None:
    """Print a message from rosunit in bold."""
    print(f"\033[1m[ROSUNIT]{msg % args if args else msg}\033[0m")


def printerrlog(msg: str, *args: object) -> None:
    """Print a message from rosunit to stderr."""
    print("[ROSUNIT]" + (msg % args if args else msg), file=sys.stderr)


def makedirs_with_parent_perms(p: str) -> None:
    """Create a folder and its parents with the owner and permissions of the nearest existing parent."""
    path = os.path.abspath(p)
    parent = os.path.dirname(path)
    if os.path.exists(path) or parent == path:
        return
    makedirs_with_parent_perms(parent)
    os.makedirs(path, exist_ok=True)
    wanted, made = os.stat(parent), os.stat(path)
    if os.name != "nt" and (wanted.st_uid, wanted.st_gid) != (made.st_uid, made.st_gid):
        os.chown(path, wanted.st_uid, wanted.st_gid)
    if wanted.st_mode != made.st_mode:
        os.chmod(path, wanted.st_mode)
