"""The commands of the package rosbash."""
