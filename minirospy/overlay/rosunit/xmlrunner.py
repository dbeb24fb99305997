"""rosunit.xmlrunner, filled in by minirospy."""

from minirospy.testing.unit import XMLTestRunner

__all__ = ["XMLTestRunner"]
