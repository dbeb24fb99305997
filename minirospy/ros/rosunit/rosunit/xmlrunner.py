"""Provides the names in ROS's module rosunit.xmlrunner."""

from minirospy.ros.rosunit.rosunit.junitxml import cdata, python2
from minirospy.ros.rosunit.runner.unit import XMLTestRunner

__all__ = [
    "XMLTestRunner",
    "cdata",
    "python2",
]
