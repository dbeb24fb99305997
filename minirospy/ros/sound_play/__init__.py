"""The ROS package sound_play."""
