"""A bridge between ROS 1 and ROS 2 for topics, services, actions and parameters, based on an installed ROS 2 or on Zenoh."""
