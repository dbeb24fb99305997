"""The ROS package camera_calibration_parsers."""
