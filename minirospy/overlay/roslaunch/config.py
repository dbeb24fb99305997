"""roslaunch.config, filled in by minirospy."""

from minirospy.launch.config import ROSLaunchConfig, load_config_default

__all__ = ["ROSLaunchConfig", "load_config_default"]
