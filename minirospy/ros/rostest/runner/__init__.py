"""Tests of ROS packages: unit tests that write JUnit XML, and launch files with ``<test>`` tags.

Source: http://wiki.ros.org/rostest, http://wiki.ros.org/rosunit.
"""
