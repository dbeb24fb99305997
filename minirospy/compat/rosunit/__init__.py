"""rosunit: unit tests that write JUnit XML. Source: http://wiki.ros.org/rosunit."""

__version__ = "1.0.0"
