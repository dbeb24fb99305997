"""The subscriber's end of a connection that uses a ring of shared memory. Linux only. Source: docs/shared_memory.md."""

from __future__ import annotations

import array
import contextlib
import logging
import mmap
import os
import socket

from minirospy.base.errors import WireError
from minirospy.core.wire import ring
from minirospy.core.wire.framing import split_frame
from minirospy.core.wire.ring import Announcement
from minirospy.runtime.transport.shared_memory import may_share

__all__ = ["RingReceiver"]

_FILES = 2  # number of file descriptors in an offer: the ring, and the eventfd that counts released places

_log = logging.getLogger(__name__)


class RingReceiver:
    """The subscriber's end of one connection. Use it only in the thread that reads the socket."""

    def __init__(self) -> None:
        self.expects_files = False  # whether file descriptors may arrive with the next bytes
        self._files: list[int] = []  # file descriptors received and not used yet
        self._map: mmap.mmap | None = None
        self._size = 0
        self._counter = -1

    def prepare(self, sock: socket.socket) -> None:
        """Answer the publisher's request, and receive file descriptors from now on."""
        self.expects_files = True
        _answer(sock, ring.READY)

    def receive(self, sock: socket.socket, count: int, flags: int = 0) -> bytes:
        """Receive up to ``count`` bytes, and any file descriptors sent with them."""
        space = socket.CMSG_SPACE(_FILES * array.array("i").itemsize)
        data, ancillary, _, _ = sock.recvmsg(count, space, flags | socket.MSG_CMSG_CLOEXEC)
        for level, kind, payload in ancillary:
            if (level, kind) == (socket.SOL_SOCKET, socket.SCM_RIGHTS):
                files = array.array("i")
                files.frombytes(payload[: len(payload) - len(payload) % files.itemsize])
                self._files += files
        return data

    def take_offer(self, sock: socket.socket, data: bytes) -> None:
        """Map the offered ring, and answer. Raise WireError if the offer is invalid."""
        size = ring.parse_offer(data)
        self.expects_files = False
        files, self._files = self._files, []
        self._release_ring()
        try:
            # Descriptors are missing if this process has reached its limit on open files.
            if len(files) == _FILES and may_share(sock) and _is_sealed(files[0], size):
                self._map = mmap.mmap(files[0], size, mmap.MAP_SHARED, mmap.PROT_READ)
                self._size, self._counter = size, files.pop()
        except (OSError, ValueError) as error:
            _log.debug("a publisher's shared memory is not used: %s", error)
        finally:
            for file in files:
                os.close(file)
        _answer(sock, ring.MAPPED if self._map else ring.REFUSED)

    def read(self, data: bytes) -> bytes:
        """Return a copy of an announced message, and release its place. Raise WireError if the announcement is invalid."""
        offset, size, array_size, rest_size = self._parse(data)
        assert self._map is not None
        end = offset + size
        if not array_size:
            whole = self._map[offset:end]
            os.eventfd_write(self._counter, 1)
            return whole

        rest = end - rest_size
        start = rest - array_size
        parts = self._map[offset:start], self._map[start:rest], self._map[rest:end]
        os.eventfd_write(self._counter, 1)
        return split_frame(*parts)

    def close(self) -> None:
        """Unmap the ring and close all descriptors. Idempotent."""
        self._release_ring()
        for file in self._files:
            os.close(file)
        self._files = []

    def _parse(self, data: bytes) -> Announcement:
        if self._map is None:
            raise WireError("a message in shared memory was announced before any memory was offered")
        return ring.parse_announcement(data, self._size)

    def _release_ring(self) -> None:
        if self._map:
            self._map.close()
            self._map = None
        if self._counter >= 0:
            os.close(self._counter)
            self._counter = -1


def _answer(sock: socket.socket, byte: bytes) -> None:
    # The publisher may have sent messages before closing the connection: read them, then report the end.
    with contextlib.suppress(OSError):
        sock.send(byte)


def _is_sealed(file: int, size: int) -> bool:
    """Return whether a file has this size and cannot shrink. Raise OSError if it cannot be sealed at all."""
    import fcntl

    return os.fstat(file).st_size == size and bool(fcntl.fcntl(file, fcntl.F_GET_SEALS) & fcntl.F_SEAL_SHRINK)
