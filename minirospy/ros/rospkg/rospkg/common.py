"""rospkg.common: file names, and the error for names that are not found."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["MANIFEST_FILE", "PACKAGE_FILE", "ROS_STACK", "STACK_FILE", "ResourceNotFound"]

MANIFEST_FILE = "manifest.xml"
PACKAGE_FILE = "package.xml"
STACK_FILE = "stack.xml"
ROS_STACK = "ros"


class ResourceNotFound(Exception):
    """Raised if no package or stack has the given name. ``ros_paths`` holds the folders searched."""

    def __init__(self, msg: str, ros_paths: Sequence[str] | None = None, nearest: Sequence[str] = ()) -> None:
        super().__init__(msg)
        self.ros_paths = ros_paths
        self.nearest = nearest

    def __str__(self) -> str:
        hint = f" (did you mean {' or '.join(self.nearest)}?)" if self.nearest else ""
        paths = [f"ROS path [{index}]={path}" for index, path in enumerate(self.ros_paths or ())]
        return "\n".join([f"{self.args[0]}{hint}", *paths])
