"""ROS packages on disk: their folders and contents."""
