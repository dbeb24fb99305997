"""Replacements for calls that fail on machines without shared memory."""

from __future__ import annotations

import mmap
import socket
from typing import Any

from minirospy.core.wire import ring
from minirospy.runtime.transport.ring_receiver import RingReceiver


def no_memory(_file: int, _offset: int, _size: int) -> None:
    raise OSError("no space left")


def no_map(*_: Any, **__: Any) -> mmap.mmap:
    raise OSError("no mapping here")


def refuse(self: RingReceiver, sock: socket.socket, _data: bytes) -> None:
    self.expects_files = False
    self.close()
    sock.send(ring.REFUSED)
