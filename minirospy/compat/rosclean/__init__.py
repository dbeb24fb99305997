"""rosclean, filled in by minirospy: how much log files take. Source: http://wiki.ros.org/rosclean."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from minirospy.cli.ros.rosclean import disk_usage, human_size, main

__all__ = ["CleanupException", "get_disk_usage", "get_human_readable_disk_usage", "rosclean_main"]


class CleanupException(Exception):
    """A folder whose size cannot be told."""


def get_disk_usage(d: str) -> int:
    """The bytes that a folder takes. Raises CleanupException."""
    if not Path(d).is_dir():
        raise CleanupException(f"[{d}] is no folder")
    return disk_usage(Path(d))


def get_human_readable_disk_usage(d: str) -> str:
    """The same as `du -h` prints it. Raises CleanupException."""
    return human_size(get_disk_usage(d))


def rosclean_main(argv: Sequence[str] | None = None) -> int:
    """The command; ``argv`` begins with its name. Its exit status."""
    return main(list(sys.argv if argv is None else argv)[1:])
