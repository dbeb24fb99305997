"""rostest, provided by minirospy: tests that are nodes. Source: http://wiki.ros.org/rostest."""

from minirospy.ros.rostest.rostest import rostestmain
from minirospy.ros.rostest.runner.node import get_master, is_publisher, is_subscriber, rosrun, run, unitrun
from minirospy.ros.rostest.runner.unit import XML_OUTPUT_FLAG

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
