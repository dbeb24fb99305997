"""rosnode, provided by minirospy: queries about nodes, and shutting them down. Source: http://wiki.ros.org/rosnode."""

import rosgraph as rosgraph

from minirospy.ros.rosnode.rosnode import (
    ID,
    NAME,
    ROSNodeException,
    ROSNodeIOException,
    cleanup_master_blacklist,
    cleanup_master_whitelist,
    get_api_uri,
    get_machines_by_nodes,
    get_node_connection_info_description,
    get_node_info_description,
    get_node_names,
    get_nodes_by_machine,
    kill_nodes,
    rosnode_cleanup,
    rosnode_info,
    rosnode_listnodes,
    rosnode_ping,
    rosnode_ping_all,
    rosnodemain,
)
from minirospy.ros.rosnode.rosnode import _sub_rosnode_listnodes as _sub_rosnode_listnodes
from minirospy.ros.rosnode.rosnode import _succeed as _succeed

__all__ = [
    "ID", "NAME", "ROSNodeException", "ROSNodeIOException", "cleanup_master_blacklist", "cleanup_master_whitelist",
    "get_api_uri", "get_machines_by_nodes", "get_node_connection_info_description", "get_node_info_description",
    "get_node_names", "get_nodes_by_machine", "kill_nodes", "rosnode_cleanup", "rosnode_info", "rosnode_listnodes",
    "rosnode_ping", "rosnode_ping_all", "rosnodemain",
]  # fmt: skip
from minirospy.ros.rosnode.rosnode import _fullusage as _fullusage
from minirospy.ros.rosnode.rosnode import _rosnode_cmd_cleanup as _rosnode_cmd_cleanup
from minirospy.ros.rosnode.rosnode import _rosnode_cmd_info as _rosnode_cmd_info
from minirospy.ros.rosnode.rosnode import _rosnode_cmd_kill as _rosnode_cmd_kill
from minirospy.ros.rosnode.rosnode import _rosnode_cmd_list as _rosnode_cmd_list
from minirospy.ros.rosnode.rosnode import _rosnode_cmd_machine as _rosnode_cmd_machine
from minirospy.ros.rosnode.rosnode import _rosnode_cmd_ping as _rosnode_cmd_ping
