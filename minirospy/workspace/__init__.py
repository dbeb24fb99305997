"""ROS packages on disk: where they are, what they hold."""
