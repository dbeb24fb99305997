"""Provides the names in ROS's module rosunit.baretest."""

from minirospy.ros.rosunit.runner.unit import print_runner_summary, print_unittest_summary

__all__ = [
    "BARE_TIME_LIMIT",
    "TIMEOUT_SIGINT",
    "TIMEOUT_SIGTERM",
    "TestTimeoutException",
    "print_runner_summary",
    "print_unittest_summary",
]

BARE_TIME_LIMIT = 60.0  # time limit in seconds for a test in a separate program
TIMEOUT_SIGINT = 15.0  # seconds to wait after SIGINT before sending SIGTERM
TIMEOUT_SIGTERM = 2.0  # seconds to wait after SIGTERM before sending SIGKILL


class TestTimeoutException(Exception):
    """Raised if a test exceeds its time limit."""

    __test__ = False  # prevents pytest from collecting this class
