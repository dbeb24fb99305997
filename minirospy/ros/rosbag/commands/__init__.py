"""The commands of the package rosbag."""
