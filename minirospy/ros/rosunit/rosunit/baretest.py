"""The names of rosunit.baretest."""

from minirospy.ros.rosunit.runner.unit import print_runner_summary, print_unittest_summary

__all__ = [
    "BARE_TIME_LIMIT",
    "TIMEOUT_SIGINT",
    "TIMEOUT_SIGTERM",
    "TestTimeoutException",
    "print_runner_summary",
    "print_unittest_summary",
]

BARE_TIME_LIMIT = 60.0  # seconds, for a program that is a test
TIMEOUT_SIGINT = 15.0  # seconds after SIGINT before SIGTERM
TIMEOUT_SIGTERM = 2.0  # seconds after SIGTERM before SIGKILL


class TestTimeoutException(Exception):
    """A test did not end in time."""

    __test__ = False  # pytest: this is no test
