"""ROS's commands: `roscore`, `rosrun`, `roslaunch`, `rostopic` and others."""
