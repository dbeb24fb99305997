"""rospkg.distro: determines the environment's ROS distribution."""

from __future__ import annotations

from collections.abc import Mapping

from minirospy.workspace import folders

__all__ = ["current_distro_codename"]


def current_distro_codename(env: Mapping[str, str] | None = None) -> str:
    """Return ROS_DISTRO, by default the last ROS 1 distribution."""
    return folders.distro_codename(env)
