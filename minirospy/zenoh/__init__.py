"""Code for the library eclipse-zenoh that the fleet and the bridge to ROS 2 share."""
