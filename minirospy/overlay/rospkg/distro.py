"""rospkg.distro, filled in by minirospy."""

from minirospy.compat.rospkg.distro import current_distro_codename

__all__ = ["current_distro_codename"]
