"""Make ROS 1's Python packages importable if ROS 2 is sourced, which puts its std_msgs, tf2_ros, ... first on PYTHONPATH.

`import rospy` and the commands call :func:`prefer_ros1` before the process imports ROS 1 messages. The bridge to
ROS 2 does not call it, because its process needs ROS 2's packages.
"""

from __future__ import annotations

import functools
import os
import re
import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType

__all__ = ["is_of_ros2", "prefer_ros1"]

_OVERLAY = os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "overlay")
_SUITABLE = frozenset(
    {
        "PyKDL",
        "RPi",
        "ament_index_python",
        "angles",
        "catkin",
        "genmsg",
        "kdl_parser_py",
        "python_qt_binding",
        "qt_dotgraph",
        "qt_gui",
        "qt_gui_py_common",
        "rospkg",
        "smach",
        "urdf_parser_py",
    }
)
"""Packages that need neither a client library nor messages, so that ROS 1 programs can use ROS 2's version of them."""
# suffixes of message packages, which may be in a workspace and not in the overlay
_SUFFIXES = ("_msgs", "_srvs")
_GENERATED = re.compile(rb"^from [\w.]+\.(?:msg|srv|action)\._\w+ import ", re.MULTILINE)
"""Matches msg/__init__.py as rosidl generates it; ROS 1 generates `from ._Name import *`."""
_INDEX = os.path.join("share", "ament_index", "resource_index", "packages")
_MAX_PARENTS = (
    # number of folders from a package up to its prefix: prefix/local/lib/python3.12/dist-packages/std_msgs
    5
)


def prefer_ros1() -> None:
    """Make imports such as `import std_msgs` skip ROS 2's packages. Idempotent; no effect without ROS 2.

    Raise ImportError if ROS 2 messages are already imported, because a process can have only one package with each name.
    """
    if any(isinstance(each, _Finder) for each in sys.meta_path):
        return
    finder = _Finder(_overlay_packages())
    for name in sorted(finder.names & sys.modules.keys()):
        spec = getattr(sys.modules[name], "__spec__", None)
        if spec is not None and is_of_ros2(spec):
            raise ImportError(
                f"{name} of ROS 2 has been imported already ({spec.origin}), and rospy needs that of ROS 1: import rospy before "
                "any messages, or start the program in a terminal in which ROS 2 is not sourced",
                name=name,
            )
    sys.meta_path.insert(0, finder)


def is_of_ros2(spec: ModuleSpec) -> bool:
    """Return whether a top-level package belongs to ROS 2."""
    for folder in spec.submodule_search_locations or ():
        if any(_is_generated(os.path.join(folder, kind, "__init__.py")) for kind in ("msg", "srv", "action")):
            return True
        prefix = os.path.abspath(folder)
        for _ in range(_MAX_PARENTS):
            prefix = os.path.dirname(prefix)
            if os.path.isfile(os.path.join(prefix, _INDEX, spec.name)):
                return True
    return False


class _Finder:
    """The first entry of ``sys.meta_path``: finds packages whose first occurrence on ``sys.path`` belongs to ROS 2."""

    def __init__(self, names: frozenset[str]) -> None:
        self.names = names

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return the spec of the first package on ``sys.path`` that is not ROS 2's, or None to leave it to the other finders."""
        if path is not None or not (fullname in self.names or fullname.endswith(_SUFFIXES)):
            return None
        found = PathFinder.find_spec(fullname)
        if found is None or not is_of_ros2(found):
            return None
        for entry in sys.path:
            found = PathFinder.find_spec(fullname, [entry])
            if found is not None and not is_of_ros2(found):
                return found
        return None


@functools.lru_cache(maxsize=1)
def _overlay_packages() -> frozenset[str]:
    try:
        return frozenset(os.listdir(_OVERLAY)) - _SUITABLE
    except OSError:
        return frozenset()


def _is_generated(file: str) -> bool:
    try:
        with open(file, "rb") as opened:
            return bool(_GENERATED.search(opened.read()))
    except OSError:
        return False
