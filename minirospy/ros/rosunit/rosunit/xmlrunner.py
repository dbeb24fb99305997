"""The names of rosunit.xmlrunner."""

from minirospy.ros.rosunit.runner.unit import XMLTestRunner

__all__ = ["XMLTestRunner"]
