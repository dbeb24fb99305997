"""tf2_geometry_msgs: points, vectors and poses for tf2_ros; importing it registers them."""
