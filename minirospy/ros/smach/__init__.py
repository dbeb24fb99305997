"""The ROS package smach."""
