"""ROS packages, one folder each. `overlay_modules.py` re-exports their Python modules under ROS's names."""
