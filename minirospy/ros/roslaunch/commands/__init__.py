"""The commands of the ROS package roslaunch."""
