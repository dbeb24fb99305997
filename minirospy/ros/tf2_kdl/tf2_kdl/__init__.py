"""tf2_kdl: registers PyKDL's types with tf2_ros when it is imported."""
