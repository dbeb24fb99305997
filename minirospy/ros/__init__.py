"""ROS packages, one folder each; `overlay_modules.py` offers their Python modules under ROS's names."""
