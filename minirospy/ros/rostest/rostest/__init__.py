"""rostest: tests that are nodes. Source: http://wiki.ros.org/rostest."""

__all__ = ["rostestmain"]


def rostestmain() -> None:
    """Run the command `rostest`, and exit."""
    import sys

    from minirospy.ros.rostest.commands.rostest import rostest

    sys.exit(rostest())
