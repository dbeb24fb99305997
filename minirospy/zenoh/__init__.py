"""Code that the fleet and the ROS 2 bridge share for using the eclipse-zenoh library."""
