"""sensor_msgs: the package's Python modules, besides its messages."""
