"""rostest: tests that are nodes. Source: http://wiki.ros.org/rostest."""

__all__ = ["rostestmain"]


def rostestmain() -> None:
    """Run the command `rostest`, and exit."""
    import sys

    from minirospy.cli.ros.rostest import rostest

    sys.exit(rostest())
