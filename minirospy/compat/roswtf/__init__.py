"""roswtf, filled in by minirospy: what is wrong with a graph. Source: http://wiki.ros.org/roswtf."""

__all__ = ["roswtf_main"]


def roswtf_main() -> None:
    """The command on this process's command line; ends the process."""
    import sys

    from minirospy.cli.doctor import roswtf

    sys.exit(roswtf())
