"""roswtf.model, provided by minirospy: what a check found."""

from minirospy.ros.roswtf.roswtf.model import WtfError, WtfWarning

__all__ = [
    "WtfError",
    "WtfWarning",
]
