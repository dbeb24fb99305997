"""rosmaster.paramserver, provided by minirospy: the tree of parameters."""

from minirospy.ros.rosmaster.rosmaster.paramserver import GLOBALNS, SEP, ParamDictionary

__all__ = [
    "GLOBALNS",
    "SEP",
    "ParamDictionary",
]
