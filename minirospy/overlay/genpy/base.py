"""genpy.base, provided by minirospy: the types that `struct` packs."""

from minirospy.ros.genpy.genpy.base import SIMPLE_TYPES, SIMPLE_TYPES_DICT, MsgGenerationException, is_simple

__all__ = ["SIMPLE_TYPES", "SIMPLE_TYPES_DICT", "MsgGenerationException", "is_simple"]
