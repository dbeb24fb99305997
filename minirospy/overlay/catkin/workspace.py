"""catkin.workspace, provided by minirospy: the workspaces of the environment."""

from minirospy.ros.catkin.catkin.workspace import CATKIN_MARKER_FILE, get_source_paths, get_workspaces

__all__ = ["CATKIN_MARKER_FILE", "get_source_paths", "get_workspaces"]
