"""The commands of ROS: `roscore`, `rosrun`, `roslaunch`, `rostopic` and their family."""
