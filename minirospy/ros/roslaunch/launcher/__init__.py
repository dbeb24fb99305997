"""roslaunch: loads launch files and runs their nodes."""
