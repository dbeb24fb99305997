"""roslaunch.launch, filled in by minirospy."""

from minirospy.launch.parent import ProcessListener as ROSLaunchListener

__all__ = ["ROSLaunchListener"]
