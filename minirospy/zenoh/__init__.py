"""What the fleet and the bridge to ROS 2 share for using the library eclipse-zenoh."""
