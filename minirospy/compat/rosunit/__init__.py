"""rosunit: unit tests that write JUnit XML. Source: http://wiki.ros.org/rosunit."""

from minirospy.compat.submodules import on_first_use

__version__ = "1.0.0"

__getattr__ = on_first_use("rosunit", "pmon")


def rosunitmain() -> None:
    """Run the command `rosunit`, and exit."""
    import sys

    from minirospy.cli.ros.rostest import rosunit

    sys.exit(rosunit())
