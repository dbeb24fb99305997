"""rospkg.distro, provided by minirospy: the distribution of ROS that the environment names."""

from minirospy.ros.rospkg.rospkg.distro import current_distro_codename

__all__ = ["current_distro_codename"]
