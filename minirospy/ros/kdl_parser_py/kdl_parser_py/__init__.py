"""kdl_parser_py: a robot description as a tree of segments. Source: http://wiki.ros.org/kdl_parser_py."""
