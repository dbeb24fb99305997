"""tf2_sensor_msgs: registers point clouds with tf2_ros when it is imported."""
