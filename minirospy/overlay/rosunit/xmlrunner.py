"""rosunit.xmlrunner, provided by minirospy."""

from minirospy.testing.unit import XMLTestRunner

__all__ = ["XMLTestRunner"]
