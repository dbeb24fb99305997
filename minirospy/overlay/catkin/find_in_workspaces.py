"""catkin.find_in_workspaces, provided by minirospy: the files of a package in all workspaces."""

from minirospy.ros.catkin.catkin.find_in_workspaces import find_in_workspaces
from minirospy.ros.catkin.catkin.workspace import get_source_paths as get_source_paths
from minirospy.ros.catkin.catkin.workspace import get_workspaces as get_workspaces

__all__ = ["find_in_workspaces"]
