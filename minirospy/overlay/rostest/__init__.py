"""rostest, provided by minirospy: tests that are nodes. Source: http://wiki.ros.org/rostest."""

from minirospy.compat.rostest import rostestmain
from minirospy.testing.node import get_master, is_publisher, is_subscriber, rosrun, run, unitrun
from minirospy.testing.unit import XML_OUTPUT_FLAG

__all__ = [
    "XML_OUTPUT_FLAG",
    "get_master",
    "is_publisher",
    "is_subscriber",
    "rosrun",
    "rostestmain",
    "run",
    "unitrun",
]
