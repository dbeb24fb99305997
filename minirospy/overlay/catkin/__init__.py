"""catkin, provided by minirospy: the workspaces of the environment."""
