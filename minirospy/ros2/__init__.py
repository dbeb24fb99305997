"""ROS 1 and ROS 2 in one graph: topics and services pass from each to the other, next to an installed ROS 2 or over Zenoh."""
