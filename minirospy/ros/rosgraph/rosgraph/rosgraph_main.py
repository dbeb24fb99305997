"""rosgraph.rosgraph_main: the command `rosgraph`."""

__all__ = ["rosgraph_main"]


def rosgraph_main() -> None:
    """Run the command on this process's command line, and exit."""
    import sys

    from minirospy.ros.rosgraph.commands.rosgraph import main

    sys.exit(main())
