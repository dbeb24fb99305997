"""rostest, filled in by minirospy: tests that are nodes. Source: http://wiki.ros.org/rostest."""

__all__ = ["rostestmain"]


def rostestmain() -> None:
    """What the command `rostest` runs; ends the process."""
    import sys

    from minirospy.cli.ros.rostest import rostest

    sys.exit(rostest())
