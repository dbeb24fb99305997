"""catkin, filled in by minirospy: where the workspaces are, and files in them. Builds are catkin_make's business."""
