"""roslaunch: turns launch files into running nodes."""
