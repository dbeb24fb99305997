"""rospkg.distro: the distribution of ROS that the environment names."""

from __future__ import annotations

from collections.abc import Mapping

from minirospy.workspace import folders

__all__ = ["current_distro_codename"]


def current_distro_codename(env: Mapping[str, str] | None = None) -> str:
    """Return ROS_DISTRO, or the last distribution of ROS 1."""
    return folders.distro_codename(env)
