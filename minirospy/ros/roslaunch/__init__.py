"""The ROS package roslaunch."""
