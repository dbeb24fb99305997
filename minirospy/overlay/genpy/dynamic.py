"""genpy.dynamic, provided by minirospy: message classes from a full text."""

from minirospy.ros.genpy.genpy.base import MsgGenerationException
from minirospy.ros.genpy.genpy.dynamic import generate_dynamic

__all__ = ["MsgGenerationException", "generate_dynamic"]
