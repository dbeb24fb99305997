"""`rosrun gazebo_ros gzclient`: the simulation's window is the 3D view of minirospy's dashboard, in a browser."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from minirospy import client as rospy
from minirospy.ros.gazebo_ros.gzserver import ABOUT

__all__ = ["main"]

_VIEW = Path(__file__).parent / "worlds" / "world.rviz"


def main(argv: Sequence[str] | None = None) -> int:
    """Open the page, and serve it until Ctrl-C; return the exit status, 1 if a library for the dashboard is missing."""
    parser = argparse.ArgumentParser(prog="gzclient", description=f"{ABOUT}: the world in a browser")
    parser.add_argument("-v", "--version", action="version", version=ABOUT)
    parser.add_argument("--verbose", action="store_true", help="no effect")
    parser.add_argument("--no-browser", action="store_true", help="print the link, and open no browser")
    arguments, remaining = parser.parse_known_args(list(rospy.myargv()[1:] if argv is None else argv))
    del remaining  # options of Gazebo's window

    from minirospy.cli.dashboard import rviz

    words = ["-f", "world", "-d", str(_VIEW), *(["--no-browser"] if arguments.no_browser else [])]
    return int(rviz(words))
