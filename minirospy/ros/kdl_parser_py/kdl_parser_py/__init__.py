"""kdl_parser_py: converts a robot description to a tree of segments. Source: http://wiki.ros.org/kdl_parser_py."""
