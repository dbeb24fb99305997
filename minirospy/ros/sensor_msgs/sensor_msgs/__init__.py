"""sensor_msgs: what its package offers besides messages."""
