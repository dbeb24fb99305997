"""roswtf.environment, provided by minirospy: checks of paths and addresses."""

from minirospy.ros.roswtf.roswtf.environment import invalid_url, is_executable, paths

__all__ = [
    "invalid_url",
    "is_executable",
    "paths",
]
