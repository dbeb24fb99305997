"""controller_manager_msgs: the package's Python modules, besides its messages."""
