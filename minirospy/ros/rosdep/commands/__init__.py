"""The commands of the package rosdep."""
