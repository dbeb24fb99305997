"""Remove SO_LINGER from Zenoh's TCP links, so that closing them does not block.

Zenoh sets SO_LINGER to 10 s on each link: if the peer is lost, closing the link blocks one of Zenoh's threads for 10 s,
and other threads wait for that thread. A router that lost 1,000 robots together spent minutes closing their links, and
read nothing from half of the robots that had reconnected (eclipse-zenoh 1.10.2, which has no option to change this).
Without SO_LINGER the kernel sends the remaining data after the close.
"""

from __future__ import annotations

import contextlib
import os
import socket
import stat
import struct
import sys
from pathlib import Path

__all__ = ["LingerRemover"]

_OPEN_FILES = Path("/proc/self/fd" if sys.platform == "linux" else "/dev/fd")
_LINGER = struct.Struct("ii")
_ZENOHS = _LINGER.pack(1, 10)
_NONE = _LINGER.pack(0, 0)
LOOKS = 10
"""Number of polls in which a new file descriptor is examined: Zenoh sets SO_LINGER only some time after connecting."""


class LingerRemover:
    """Removes SO_LINGER from the links that Zenoh opens in this process."""

    def __init__(self) -> None:
        self._looks: dict[tuple[int, int], int] = {}
        """Number of polls that have examined each open file."""

    def look(self) -> int:
        """Remove SO_LINGER from new links; return how many were changed. Does nothing on Windows."""
        if sys.platform == "win32":
            return 0
        looks: dict[tuple[int, int], int] = {}
        count = 0
        with contextlib.suppress(OSError):
            for name in os.listdir(_OPEN_FILES):
                # Ignore errors, because other threads open and close files at the same time.
                with contextlib.suppress(OSError):
                    file = os.fstat(int(name))
                    identity = file.st_dev, file.st_ino
                    looks[identity] = min(self._looks.get(identity, 0) + 1, LOOKS + 1)
                    if looks[identity] <= LOOKS and _removes(int(name), file):
                        count += 1
        self._looks = looks
        return count


def _removes(number: int, file: os.stat_result) -> bool:
    """Remove SO_LINGER from a socket if Zenoh has set it; return whether it was removed."""
    if not stat.S_ISSOCK(file.st_mode):
        return False
    with socket.socket(fileno=os.dup(number)) as sock:
        if sock.family not in (socket.AF_INET, socket.AF_INET6) or sock.type != socket.SOCK_STREAM:
            return False
        if sock.getsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _LINGER.size) != _ZENOHS:
            return False
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _NONE)
    return True
