"""kdl_parser_py, provided by minirospy: the tree of a robot description. Source: http://wiki.ros.org/kdl_parser_py."""
