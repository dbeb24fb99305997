"""The ROS package rosconsole."""
