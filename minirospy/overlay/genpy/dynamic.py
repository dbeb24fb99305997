"""genpy.dynamic, filled in by minirospy: message classes from a full text."""

from minirospy.compat.genpy.message import MsgGenerationException, generate_dynamic

__all__ = ["MsgGenerationException", "generate_dynamic"]
