"""TCP links of Zenoh close without waiting.

Zenoh sets SO_LINGER to 10 s on each: where the peer is lost, closing blocks one of its threads for so long, and others wait
for that one. A router that lost 1,000 robots together closed their links for minutes, and read nothing of half of those that
came again (eclipse-zenoh 1.10.2, which has no option for it). Without SO_LINGER the kernel sends the rest after the close.
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


class LingerRemover:
    """Finds the links that Zenoh has opened in this process."""

    def __init__(self) -> None:
        self._seen: set[tuple[int, int]] = set()

    def look(self) -> int:
        """Remove SO_LINGER from the links that are new; return how many. Without effect on Windows."""
        if sys.platform == "win32":
            return 0
        seen, count = set(), 0
        with contextlib.suppress(OSError):
            for name in os.listdir(_OPEN_FILES):
                # Others open and close files meanwhile.
                with contextlib.suppress(OSError):
                    file = os.fstat(int(name))
                    identity = file.st_dev, file.st_ino
                    seen.add(identity)
                    if identity not in self._seen and _removes(int(name), file):
                        count += 1
        self._seen = seen
        return count


def _removes(number: int, file: os.stat_result) -> bool:
    """Remove SO_LINGER where it is Zenoh's; return whether it was."""
    if not stat.S_ISSOCK(file.st_mode):
        return False
    with socket.socket(fileno=os.dup(number)) as sock:
        if sock.family not in (socket.AF_INET, socket.AF_INET6) or sock.type != socket.SOCK_STREAM:
            return False
        if sock.getsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _LINGER.size) != _ZENOHS:
            return False
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _NONE)
    return True
