"""roswtf: what is wrong with a graph. Source: http://wiki.ros.org/roswtf."""

__all__ = ["roswtf_main"]


def roswtf_main() -> None:
    """Run the command on this process's command line, and exit."""
    import sys

    from minirospy.ros.roswtf.commands.doctor import roswtf

    sys.exit(roswtf())
