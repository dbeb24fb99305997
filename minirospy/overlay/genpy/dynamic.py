"""genpy.dynamic, provided by minirospy: message classes from a full text."""

from minirospy.compat.genpy.base import MsgGenerationException
from minirospy.compat.genpy.dynamic import generate_dynamic

__all__ = ["MsgGenerationException", "generate_dynamic"]
