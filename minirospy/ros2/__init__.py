"""A bridge between ROS 1 and ROS 2 for topics, services, actions and parameters, with an installed ROS 2 or over Zenoh."""
