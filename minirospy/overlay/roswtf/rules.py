"""roswtf.rules, provided by minirospy: from checks to errors and warnings."""

from minirospy.ros.roswtf.roswtf.rules import error_rule, warning_rule

__all__ = [
    "error_rule",
    "warning_rule",
]
