"""Let a program import a package with the same name as a file in its folder: `turtlebot.msg` in turtlebot.py.

Python searches the program's folder first, so `from turtlebot.msg import Speed` in turtlebot.py would import
turtlebot.py again instead of the package. `import rospy` calls :func:`find_packages_named_like_scripts`.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec, PathFinder
from importlib.util import spec_from_file_location
from types import ModuleType

from minirospy.base.ros1_imports import find_ros1, is_of_ros2

__all__ = ["find_packages_named_like_scripts"]


def find_packages_named_like_scripts() -> None:
    """Make imports find packages that are hidden by files in the program's folder. Idempotent.

    No effect if Python does not search the program's folder.
    """
    main = sys.modules.get("__main__")
    file = getattr(main, "__file__", None)
    # Do nothing for a program started with `python -m`, which has a spec: Python does not search its folder.
    if (
        not file
        or getattr(main, "__spec__", None)
        or any(isinstance(each, _Finder) for each in sys.meta_path)
    ):
        return
    path = os.path.abspath(file)
    # Use sys.path[0]: a program copied by catkin_make runs the source file, but Python searches the folder of the copy.
    if sys.path and os.path.isfile(os.path.join(sys.path[0], os.path.basename(path))):
        sys.meta_path.insert(0, _Finder(sys.path[0], os.path.basename(path)))


class _Finder:
    """Finds packages with the same name as a file in ``folder``. ``program`` is the name of the program's own file."""

    def __init__(self, folder: str, program: str) -> None:
        self._folder = folder
        self._program = program

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return the package's spec, or None if no file in the folder hides it.

        The program's own file is not imported again. Any other file is imported, and the package's submodules are found
        in addition to it.
        """
        if path is not None:
            return None
        file = os.path.join(self._folder, f"{fullname}.py")
        if not os.path.isfile(file) or os.path.isdir(os.path.join(self._folder, fullname)):
            return None

        others = [entry for entry in sys.path if entry != self._folder]
        package = PathFinder.find_spec(fullname, others)
        if package is not None and is_of_ros2(package):
            package = find_ros1(fullname, others) or package
        if package is None or package.submodule_search_locations is None or package.loader is None:
            return None
        if f"{fullname}.py" == self._program:
            return package
        return spec_from_file_location(
            fullname, file, submodule_search_locations=list(package.submodule_search_locations)
        )
