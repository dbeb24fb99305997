"""genmsg.command_line, provided by minirospy: the search path of message generators."""

from minirospy.ros.genmsg.genmsg.command_line import includepath_to_dict

__all__ = ["includepath_to_dict"]
