"""rosgraph.rosgraph_main: the command `rosgraph`."""

__all__ = ["rosgraph_main"]


def rosgraph_main() -> None:
    """Run the command with this process's arguments, and exit."""
    import sys

    from minirospy.ros.rosgraph.commands.rosgraph import main

    sys.exit(main())
