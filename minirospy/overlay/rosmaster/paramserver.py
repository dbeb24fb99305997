"""rosmaster.paramserver, provided by minirospy: the tree of parameters."""

from minirospy.compat.rosmaster.paramserver import (
    GLOBALNS,
    SEP,
    ParamDictionary,
)

__all__ = [
    "GLOBALNS",
    "SEP",
    "ParamDictionary",
]
