"""The names of rosunit.xmlrunner."""

from minirospy.ros.rostest.runner.unit import XMLTestRunner

__all__ = ["XMLTestRunner"]
