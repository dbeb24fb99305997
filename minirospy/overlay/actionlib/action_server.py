"""actionlib.action_server, filled in by minirospy."""

from minirospy.actionlib import ActionServer, nop_cb

__all__ = ["ActionServer", "nop_cb"]
