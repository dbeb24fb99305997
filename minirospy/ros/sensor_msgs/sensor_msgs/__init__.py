"""sensor_msgs: the package's Python modules, in addition to its messages."""
