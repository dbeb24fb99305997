"""rostest: runs tests that are nodes. Source: http://wiki.ros.org/rostest."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from minirospy.ros.rostest.runner.node import (
        get_master,
        is_publisher,
        is_subscriber,
        rosrun,
        run,
        unitrun,
    )
    from minirospy.ros.rosunit.runner.unit import XML_OUTPUT_FLAG

__all__ = [
    "XML_OUTPUT_FLAG",
    "get_master",
    "is_publisher",
    "is_subscriber",
    "rosrun",
    "rostestmain",
    "run",
    "unitrun",
]


def rostestmain() -> None:
    """Run the command `rostest` and exit."""
    import sys

    from minirospy.ros.rostest.commands.rostest import rostest

    sys.exit(rostest())
