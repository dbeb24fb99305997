"""cv_bridge.boost: the functions that ROS implements in C++, here in Python."""
