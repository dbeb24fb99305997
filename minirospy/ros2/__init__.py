"""A bridge between ROS 1 and ROS 2 for topics, services, actions and parameters, next to an installed ROS 2 or over Zenoh."""
