"""catkin: the sourced workspaces."""
