"""Tests of ROS packages: unit tests that write JUnit XML, launch files whose ``<test>`` tags are run.

Source: http://wiki.ros.org/rostest, http://wiki.ros.org/rosunit.
"""
