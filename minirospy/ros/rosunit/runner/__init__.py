"""Runs unit tests, and writes JUnit XML. Source: http://wiki.ros.org/rosunit."""
