"""roslaunch.node_args, provided by minirospy."""

from minirospy.ros.roslaunch.roslaunch.config import load_config_default as load_config_default
from minirospy.ros.roslaunch.roslaunch.node_args import (
    NodeParamsException,
    create_local_process_args,
    get_node_args,
    get_node_list,
    print_node_args,
    print_node_filename,
    print_node_list,
)

__all__ = [
    "NodeParamsException",
    "create_local_process_args",
    "get_node_args",
    "get_node_list",
    "print_node_args",
    "print_node_filename",
    "print_node_list",
]
