"""The names of rosunit.baretest."""

from minirospy.ros.rosunit.runner.unit import print_runner_summary, print_unittest_summary

__all__ = ["print_runner_summary", "print_unittest_summary"]
