"""Runs the ``<test>`` tags in launch files. Source: http://wiki.ros.org/rostest."""
