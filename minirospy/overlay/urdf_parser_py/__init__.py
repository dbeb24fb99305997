"""urdf_parser_py, provided by minirospy: robot descriptions as objects. Source: http://wiki.ros.org/urdfdom_py."""
