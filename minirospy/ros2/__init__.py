"""Bridges topics, services, actions and parameters between ROS 1 and ROS 2, with an installed ROS 2 or over Zenoh."""
