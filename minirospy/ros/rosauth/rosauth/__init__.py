"""rosauth: whether a web client may use this ROS. Source: http://wiki.ros.org/rosauth."""
