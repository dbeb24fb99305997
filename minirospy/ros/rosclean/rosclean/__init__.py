"""rosclean: determines the disk usage of log files. Source: http://wiki.ros.org/rosclean."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from minirospy.ros.rosclean.commands.rosclean import disk_usage, human_size, main

__all__ = ["CleanupException", "get_disk_usage", "get_human_readable_disk_usage", "rosclean_main"]


class CleanupException(Exception):
    """Raised if a folder's size cannot be determined."""


def get_disk_usage(d: str) -> int:
    """Return a folder's disk usage in bytes. Raise CleanupException if the folder does not exist."""
    if not isinstance(d, str | Path) or not Path(d).is_dir():
        raise CleanupException(f"[{d}] is not a folder")
    return disk_usage(Path(d))


def get_human_readable_disk_usage(d: str) -> str:
    """Return a folder's disk usage, formatted like `du -h`. Raise CleanupException if the folder does not exist."""
    return human_size(get_disk_usage(d))


def rosclean_main(argv: Sequence[str] | None = None) -> int:
    """Run the command; ``argv`` includes the command's name. Return its exit status."""
    return main(list(sys.argv if argv is None else argv)[1:])
