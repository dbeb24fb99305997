"""The names of rosunit.xmlrunner."""

from minirospy.ros.rosunit.rosunit.junitxml import cdata, python2
from minirospy.ros.rosunit.runner.unit import XMLTestRunner

__all__ = [
    "XMLTestRunner",
    "cdata",
    "python2",
]
