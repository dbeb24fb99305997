"""rosbag.rosbag_main: the verbs of `rosbag` as functions. ``argv`` starts with the program's name."""

from __future__ import annotations

import sys
from collections.abc import Sequence

__all__ = [
    "check_cmd",
    "compress_cmd",
    "decompress_cmd",
    "filter_cmd",
    "fix_cmd",
    "info_cmd",
    "play_cmd",
    "record_cmd",
    "reindex_cmd",
    "rosbagmain",
]


def rosbagmain(argv: Sequence[str] | None = None) -> None:
    """Run the command and exit if it fails."""
    _run(list(sys.argv if argv is None else argv)[1:])


def info_cmd(argv: Sequence[str]) -> None:
    """Run `rosbag info`."""
    _run(["info", *argv])


def record_cmd(argv: Sequence[str]) -> None:
    """Run `rosbag record`."""
    _run(["record", *argv])


def play_cmd(argv: Sequence[str]) -> None:
    """Run `rosbag play`."""
    _run(["play", *argv])


def filter_cmd(argv: Sequence[str]) -> None:
    """Run `rosbag filter`."""
    _run(["filter", *argv])


def fix_cmd(argv: Sequence[str]) -> None:
    """Run `rosbag fix`."""
    _run(["fix", *argv])


def check_cmd(argv: Sequence[str]) -> None:
    """Run `rosbag check`."""
    _run(["check", *argv])


def compress_cmd(argv: Sequence[str]) -> None:
    """Run `rosbag compress`."""
    _run(["compress", *argv])


def decompress_cmd(argv: Sequence[str]) -> None:
    """Run `rosbag decompress`."""
    _run(["decompress", *argv])


def reindex_cmd(argv: Sequence[str]) -> None:
    """Run `rosbag reindex`."""
    _run(["reindex", *argv])


def _run(arguments: list[str]) -> None:
    from minirospy.ros.rosbag.commands.rosbag import main

    status = main(arguments)
    if status:
        sys.exit(status)
