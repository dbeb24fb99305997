"""rosclean: show the disk usage of log files, and remove them.

Source: http://wiki.ros.org/rosclean. The output is identical to that of ROS; sizes are counted in disk blocks, as du
does. If there is no reply to the prompt (no terminal, or an empty pipe), nothing is removed.
"""

from __future__ import annotations

import math
import os
import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from minirospy.base.errors import MinirospyError, UsageError
from minirospy.command.parser import Parser
from minirospy.command.verbs import Family, Verb

__all__ = ["FAMILY", "disk_usage", "human_size", "main"]

_MEGABYTE = 1024 * 1024
_BLOCK = 4096


class _Logs(NamedTuple):
    folder: Path
    label: str


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status."""
    return FAMILY.main(argv)


def _check_parser() -> Parser:
    return Parser("rosclean check", "Print how much the log files take.")


def _check() -> None:
    for folder, label in _places():
        print(f"{human_size(disk_usage(folder))} {label}")


def _purge_parser() -> Parser:
    parser = Parser("rosclean purge", "Remove log files, after confirmation.")
    parser.add_argument("-y", dest="yes", action="store_true", help="remove them without a question")
    parser.add_argument("--size", type=int, metavar="MB", help="keep the newest, so many MB of them")
    return parser


def _purge(yes: bool, size: int | None) -> None:
    if size is not None and size < 0:
        raise UsageError(f"--size {size} is less than nothing")
    for logs in _places():
        if size is None:
            _purge_all(logs, yes=yes)
        else:
            _purge_oldest(logs, size, yes=yes)


def _purge_all(logs: _Logs, *, yes: bool) -> None:
    print(f"Purging {logs.label}.", flush=True)
    if yes or _agreed(f"rm -rf {logs.folder}"):
        _remove(logs.folder)


def _purge_oldest(logs: _Logs, megabytes: int, *, yes: bool) -> None:
    size = _size(logs.folder)
    if size <= megabytes * _MEGABYTE:
        print(f"Directory size of {logs.label} is {size // _MEGABYTE} MB which is already below the "
              f"requested threshold of {megabytes} MB.", flush=True)  # fmt: skip
        return

    print(f"Purging {logs.label} until directory size is at most {megabytes} MB "
          f"(currently {size // _MEGABYTE} MB).", flush=True)  # fmt: skip
    if yes or _agreed(f"Purge some of old logs in {logs.folder}"):
        _remove_oldest(logs.folder, size - megabytes * _MEGABYTE)


def _places() -> list[_Logs]:
    """Return the existing log folders."""
    from minirospy.workspace.folders import log_dir, ros_home

    places = (
        _Logs(Path(log_dir()), "ROS node logs"),
        _Logs(Path(ros_home(), "rosmake"), "rosmake logs"),
    )
    return [each for each in places if each.folder.is_dir()]


def _agreed(command: str) -> bool:
    """Prompt for confirmation of ``command`` until the user types y or n; return whether it was y."""
    question = f"PLEASE BE CAREFUL TO VERIFY THE COMMAND BELOW!\nOkay to perform:\n\n{command}\n(y/n)?"
    while True:
        print(question, flush=True)
        try:
            answer = input().strip().lower()
        except EOFError:
            return False
        if answer in ("y", "n"):
            return answer == "y"


def _remove_oldest(folder: Path, excess: int) -> None:
    """Remove a folder's entries, oldest first, until ``excess`` bytes are removed."""
    entries = [path for path in folder.iterdir() if not path.is_symlink()]
    for path in sorted(entries, key=lambda path: path.stat().st_mtime):
        if excess <= 0:
            break
        excess -= _size(path)
        _remove(path)
    for link in folder.iterdir():
        # Remove the link `latest` if its target is gone.
        if link.is_symlink() and not link.exists():
            link.unlink()


def _remove(path: Path) -> None:
    try:
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        else:
            path.unlink()
    except OSError as error:
        raise MinirospyError(f"cannot remove {error.filename or path}: {error.strerror}") from error


def _statuses(path: Path) -> Iterator[os.stat_result]:
    """Yield the stat results of a path and everything below it. Skip entries that disappear meanwhile."""
    for each in (path, *path.rglob("*")):
        try:
            yield each.lstat()
        except OSError:
            continue


def _size(path: Path) -> int:
    return sum(status.st_size for status in _statuses(path))


def disk_usage(folder: Path) -> int:
    """Return a folder's disk usage in bytes, rounded up to blocks (on Windows, to an assumed block size)."""
    return sum(
        status.st_blocks * 512
        if hasattr(status, "st_blocks")
        else math.ceil(status.st_size / _BLOCK) * _BLOCK
        for status in _statuses(folder)
    )


def human_size(size: float) -> str:
    """Format a size like `du -h`, rounded up: 4.0K, 11M."""
    if size < 1024:
        return f"{size:.0f}"
    for unit in "KMGT":
        size /= 1024
        if math.ceil(size * 10) / 10 < 10:
            return f"{math.ceil(size * 10) / 10:.1f}{unit}"
        if math.ceil(size) < 1024:
            return f"{math.ceil(size)}{unit}"
    return f"{math.ceil(size)}T"


FAMILY = Family(
    "rosclean",
    "rosclean is a command-line tool for the log files of ROS.",
    (
        Verb("check", "check usage of log files", _check_parser, _check),
        Verb("purge", "remove log files", _purge_parser, _purge),
    ),
    "Type rosclean <command> -h for more detailed usage, e.g. 'rosclean purge -h'",
)
