"""Open files with predictable names, in folders that other users may write to, without following links.

ROS_HOME is a shared folder on some robots, and TMPDIR is shared everywhere. Another user who creates the name first can
make it a symbolic or hard link to one of the owner's files, so that the owner's program overwrites that file.
"""

from __future__ import annotations

import errno
import os
import stat
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import IO

__all__ = ["create_file", "open_file", "open_text", "read_file", "remove_file", "replace_file"]

OPEN_ELSEWHERE_PATIENCE = 1.0
"""Seconds for which to retry on Windows while another process, such as a virus scanner, has the file open."""

REFUSES_OPEN_FILES = sys.platform == "win32"

OPEN_FLAGS = (
    getattr(os, "O_BINARY", 0)
    | getattr(os, "O_NOFOLLOW", 0)
    # Without O_NONBLOCK, opening a FIFO would block until another process opens its other end.
    | getattr(os, "O_NONBLOCK", 0)
)


def open_file(path: Path, flags: int, mode: int = 0o666) -> int:
    """Open ``path`` like os.open, in binary mode, and return the file descriptor.

    Raise OSError if it cannot be opened, if it is a symbolic link, or if it is neither a device nor a regular file with a
    single hard link. With O_TRUNC the file is truncated only after these checks.
    """
    if os.path.islink(path):
        # Check for a link explicitly: Windows has no O_NOFOLLOW. On other systems, the check only makes the error clearer.
        raise _refusal(path, "it is a symbolic link, which is not followed")

    file = os.open(path, (flags & ~os.O_TRUNC) | OPEN_FLAGS, mode)
    try:
        found = os.fstat(file)
        # Allow devices: only root can create them, and a user may want /dev/null.
        if not (stat.S_ISREG(found.st_mode) or stat.S_ISCHR(found.st_mode)):
            raise _refusal(path, "it is not a regular file")
        if found.st_nlink > 1 and flags & (os.O_WRONLY | os.O_RDWR):
            raise _refusal(path, "it is a hard link to another file")

        if flags & os.O_TRUNC and stat.S_ISREG(found.st_mode):
            os.ftruncate(file, 0)
        if sys.platform != "win32":
            os.set_blocking(file, True)
    except BaseException:
        os.close(file)
        raise
    return file


def open_text(path: Path, mode: str) -> IO[str]:
    """Open ``path`` to write UTF-8 text; ``mode`` is "a" to append or "w" to truncate.

    Raise OSError as :func:`open_file` does, if the file cannot be opened or is not acceptable.
    """
    how = {"a": os.O_APPEND, "w": os.O_TRUNC}[mode]
    return os.fdopen(open_file(path, os.O_WRONLY | os.O_CREAT | how), mode, encoding="utf-8")


def create_file(path: Path, mode: int = 0o600) -> int:
    """Create ``path`` for writing, replacing any file with that name. Return the descriptor. Raise OSError if that fails."""
    remove_file(path)
    return open_file(path, os.O_RDWR | os.O_CREAT | os.O_EXCL, mode)


def read_file(path: Path) -> tuple[bytes, float]:
    """Return the bytes in ``path`` and its modification time. Raise OSError if it cannot be read."""
    with os.fdopen(open_file(path, os.O_RDONLY), "rb") as stream:
        return stream.read(), os.fstat(stream.fileno()).st_mtime


def replace_file(source: str | os.PathLike[str], target: str | os.PathLike[str]) -> None:
    """Rename ``source`` to ``target``, replacing any file with that name. Raise OSError if that fails.

    Windows refuses this while another process has one of the files open, so on Windows the rename is retried for a
    second.
    """
    _until_closed(lambda: os.replace(source, target))


def remove_file(path: Path) -> None:
    """Remove ``path`` if it exists. On Windows, retry while another process has it open. Raise OSError if that fails."""
    _until_closed(lambda: path.unlink(missing_ok=True))


def _until_closed(action: Callable[[], None]) -> None:
    end = time.monotonic() + OPEN_ELSEWHERE_PATIENCE
    pause = 0.002
    while True:
        try:
            action()
            return
        except PermissionError:
            # Do not retry on other systems: there, the cause is the folder's permissions, which waiting does not change.
            if not REFUSES_OPEN_FILES or time.monotonic() >= end:
                raise
        time.sleep(pause)
        pause = min(2 * pause, 0.05)


def _refusal(path: Path, why: str) -> OSError:
    return OSError(errno.ELOOP, why, str(path))
