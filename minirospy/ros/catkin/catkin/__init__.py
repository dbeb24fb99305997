"""catkin: finds the sourced workspaces."""
