"""tf2_kdl: PyKDL's types for tf2_ros; importing it registers them."""
