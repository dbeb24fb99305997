"""rosunit: unit tests that write JUnit XML. Source: http://wiki.ros.org/rosunit."""

__version__ = "1.0.0"


def rosunitmain() -> None:
    """Run the command `rosunit`, and exit."""
    import sys

    from minirospy.cli.ros.rostest import rosunit

    sys.exit(rosunit())
