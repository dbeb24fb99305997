"""The ROS package kdl_parser_py."""
