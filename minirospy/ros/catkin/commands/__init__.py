"""The commands of the package catkin."""
