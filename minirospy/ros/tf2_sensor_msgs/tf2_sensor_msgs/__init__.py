"""tf2_sensor_msgs: point clouds for tf2_ros; importing it registers them."""
