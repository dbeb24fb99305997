"""sensor_msgs: the Python modules of the package, besides its messages."""
