"""rosunit.xmlrunner, provided by minirospy."""

from minirospy.ros.rostest.runner.unit import XMLTestRunner

__all__ = ["XMLTestRunner"]
