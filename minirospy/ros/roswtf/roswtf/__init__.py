"""roswtf: finds problems in a graph. Source: http://wiki.ros.org/roswtf."""

__all__ = ["roswtf_main"]


def roswtf_main() -> None:
    """Run the command with this process's arguments, and exit."""
    import sys

    from minirospy.ros.roswtf.commands.doctor import roswtf

    sys.exit(roswtf())
