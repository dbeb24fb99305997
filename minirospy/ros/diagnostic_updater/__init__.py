"""The ROS package diagnostic_updater."""
