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
_LOOKS = 10
"""How often a file is examined: Zenoh creates the socket, connects it, and sets SO_LINGER only then."""


class LingerRemover:
    """Finds the links that Zenoh has opened in this process."""

    def __init__(self) -> None:
        self._looks: dict[tuple[int, int], int] = {}
        """How often each open file has been examined."""

    def look(self) -> int:
        """Remove SO_LINGER from the links that are new; return how many. Without effect on Windows."""
        if sys.platform == "win32":
            return 0
        looks: dict[tuple[int, int], int] = {}
        count = 0
        with contextlib.suppress(OSError):
            for name in os.listdir(_OPEN_FILES):
                # Others open and close files meanwhile.
                with contextlib.suppress(OSError):
                    file = os.fstat(int(name))
                    identity = file.st_dev, file.st_ino
                    looks[identity] = min(self._looks.get(identity, 0) + 1, _LOOKS + 1)
                    if looks[identity] <= _LOOKS and _removes(int(name), file):
                        count += 1
        self._looks = looks
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
