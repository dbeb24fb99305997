"""rosunit: unit tests that write JUnit XML. Source: http://wiki.ros.org/rosunit."""

from minirospy.ros.submodules import on_first_use

__version__ = "1.0.0"

__getattr__ = on_first_use("rosunit", "pmon")


def rosunitmain() -> None:
    """Run the command `rosunit`, and exit."""
    import sys

    from minirospy.ros.rostest.commands.rostest import rosunit

    sys.exit(rosunit())
