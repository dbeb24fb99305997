"""urdf_parser_py: robot descriptions as objects that programs read, change and write.

Source: http://wiki.ros.org/urdfdom_py. Unlike minirospy.core.urdf, it accepts incomplete robots.
"""
