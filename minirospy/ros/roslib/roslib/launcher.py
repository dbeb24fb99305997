"""roslib.launcher: adds a package and its dependencies to sys.path."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Sequence
from pathlib import Path

from minirospy.ros.roslib.roslib.packages import get_dir_pkg
from minirospy.ros.rospkg.rospkg.common import ResourceNotFound
from minirospy.ros.rospkg.rospkg.manifest import InvalidManifest
from minirospy.ros.rospkg.rospkg.rospack import RosPack

__all__ = ["load_manifest"]


def load_manifest(package_name: str, bootstrap_version: str = "0.7") -> None:
    """Add the ``src`` folders of a package and its dependencies to sys.path, unless the package is importable.

    The package that contains the script, or one that is importable, need not be on ROS_PACKAGE_PATH.
    Raise ResourceNotFound if a package does not exist.
    """
    rospack = RosPack()
    try:
        names = [package_name, *rospack.get_depends(package_name)]
        folders = [Path(rospack.get_path(name)) for name in names]
    except ResourceNotFound:
        own = _folder_of_script(package_name)
        if own is None and not _is_importable(package_name):
            raise
        folders = [own] if own else []
    except InvalidManifest:
        folders = [Path(rospack.get_path(package_name))]
    for folder in folders:
        source = str(folder / "src")
        modules = [found.parent.name for found in Path(source).glob("*/__init__.py")]
        # Append the folder only if one of its modules is not importable: a sourced devel folder already provides the
        # modules, together with the generated messages, which this folder lacks.
        if source not in sys.path and not all(map(_is_importable, modules)):
            sys.path.append(source)


def _folder_of_script(package: str) -> Path | None:
    """Return the folder of ``package`` if the package contains the running script, otherwise None."""
    script: Sequence[str] = sys.argv[:1]
    if not script or not script[0]:
        return None
    folder, name = get_dir_pkg(str(Path(script[0]).resolve().parent))
    return Path(folder) if folder and name == package else None


def _is_importable(name: str) -> bool:
    try:
        return importlib.util.find_spec(name) is not None
    except (AttributeError, ImportError, TypeError, ValueError):
        return False
