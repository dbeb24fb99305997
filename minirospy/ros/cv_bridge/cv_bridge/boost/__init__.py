"""cv_bridge.boost: Python versions of the functions that ROS implements in C++."""
