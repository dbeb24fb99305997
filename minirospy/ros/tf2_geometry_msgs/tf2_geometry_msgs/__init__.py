"""tf2_geometry_msgs: registers points, vectors and poses with tf2_ros when it is imported."""
