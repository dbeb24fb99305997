"""rosgraph.rosgraph_main: the command `rosgraph`."""

__all__ = ["fullusage", "rosgraph_main"]


def rosgraph_main() -> None:
    """Run the command with this process's arguments and exit."""
    import sys

    from minirospy.ros.rosgraph.commands.rosgraph import main

    sys.exit(main())


def fullusage() -> None:
    """Print the usage of `rosgraph`."""
    print("rosgraph is a command-line tool for debugging the ROS Computation Graph.\n\nUsage:\n\trosgraph\n")
