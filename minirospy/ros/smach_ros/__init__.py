"""The ROS package smach_ros."""
