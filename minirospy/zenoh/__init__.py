"""Code that the fleet and the ROS 2 bridge share for using the library eclipse-zenoh."""
