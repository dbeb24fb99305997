"""catkin: the workspaces of the environment."""
