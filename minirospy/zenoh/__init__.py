"""What the fleet and the bridge to ROS 2 share of the library eclipse-zenoh."""
