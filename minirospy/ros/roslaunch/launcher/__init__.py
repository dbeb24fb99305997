"""roslaunch: launch files in, running nodes out."""
