"""Unit tests that write JUnit XML. Source: http://wiki.ros.org/rosunit."""
