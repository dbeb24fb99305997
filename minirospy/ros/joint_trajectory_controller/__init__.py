"""Controllers that execute trajectories of joints."""
