"""rospkg.distro, filled in by minirospy."""

from minirospy.workspace.rospkg import current_distro_codename

__all__ = ["current_distro_codename"]
