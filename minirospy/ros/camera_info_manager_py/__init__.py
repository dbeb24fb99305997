"""The ROS package camera_info_manager_py."""
