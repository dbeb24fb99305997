"""The connections to a device: serial ports (through pyserial), sockets, and file-like objects from the user's program."""

from __future__ import annotations

import select
import socket
import time
from typing import Any, Protocol, runtime_checkable

from minirospy.base.errors import MinirospyError
from minirospy.base.installation import install_command

__all__ = ["File", "FilePort", "Port", "PortError", "SerialPort", "SocketPort"]

_LOOK_SECONDS = 0.1
_WRITE_SECONDS = 10
_CHUNK = 4096


class PortError(MinirospyError):
    """Raised if a connection cannot be opened or was lost. The message is one line with the reason."""


class Port(Protocol):
    """A connection to a device."""

    def read(self) -> bytes:
        """Return the bytes received, or b"" after a short wait. Raise PortError if the connection is lost."""

    def write(self, data: bytes) -> None:
        """Write all bytes. Raise PortError if the connection is lost."""

    def flush_input(self) -> None:
        """Discard received bytes that have not been read."""

    def close(self) -> None:
        """Close the connection."""


@runtime_checkable
class File(Protocol):
    """A file-like object from the program. ``read`` blocks until it has ``count`` bytes; ``flushInput`` is optional."""

    def read(self, count: int, /) -> bytes:
        """Return bytes from the device."""

    def write(self, data: bytes, /) -> object:
        """Write bytes to the device."""

    def inWaiting(self) -> int:
        """Return the number of bytes received and not yet read."""


class SerialPort:
    """A serial port. Raise PortError if it cannot be opened, ImportError if pyserial is not installed."""

    def __init__(self, path: str, baud: int, *, uses_handshake: bool = False) -> None:
        try:
            import serial  # type: ignore[import-not-found,import-untyped,unused-ignore]
        except ImportError as error:
            raise ImportError(
                f"serial ports need pyserial: {install_command('minirospy[serial]')}"
            ) from error

        self._errors: tuple[type[Exception], ...] = (serial.SerialException, OSError, TypeError)
        try:
            self._serial: Any = serial.Serial(
                path,
                baud,
                timeout=_LOOK_SECONDS,
                write_timeout=_WRITE_SECONDS,
                rtscts=uses_handshake,
                dsrdtr=uses_handshake,
            )
        except (serial.SerialException, OSError, ValueError) as error:
            raise PortError(str(error)) from error

    def read(self) -> bytes:
        """Return the bytes received, or b"" after a short wait. Raise PortError if the connection is lost."""
        try:
            first = bytes(self._serial.read(1))
            waiting = self._serial.in_waiting if first else 0
            return first + bytes(self._serial.read(waiting) if waiting else b"")
        except self._errors as error:
            raise PortError(f"Serial Port read failure: {error}") from error

    def write(self, data: bytes) -> None:
        """Write all bytes. Raise PortError if the connection is lost."""
        try:
            self._serial.write(data)
        except self._errors as error:
            raise PortError(f"Serial Port write failure: {error}") from error

    def flush_input(self) -> None:
        """Discard received bytes that have not been read."""
        try:
            self._serial.reset_input_buffer()
        except Exception as error:
            raise PortError(str(error)) from error

    def close(self) -> None:
        """Close the port."""
        self._serial.close()


class SocketPort:
    """A TCP connection."""

    def __init__(self, connection: socket.socket) -> None:
        self._socket = connection
        connection.settimeout(_WRITE_SECONDS)

    def read(self) -> bytes:
        """Return the bytes received, or b"" after a short wait. Raise PortError if the connection is closed."""
        try:
            ready, _, _ = select.select([self._socket], [], [], _LOOK_SECONDS)
            if not ready:
                return b""
            data = self._socket.recv(_CHUNK)
        except (OSError, ValueError) as error:
            raise PortError(str(error)) from error
        if not data:
            raise PortError("the device has closed the connection")
        return data

    def write(self, data: bytes) -> None:
        """Write all bytes. Raise PortError if the connection is closed."""
        try:
            self._socket.sendall(data)
        except OSError as error:
            raise PortError(str(error)) from error

    def flush_input(self) -> None:
        """Do nothing: a new TCP connection has no stray bytes."""

    def close(self) -> None:
        """Close the connection."""
        self._socket.close()


class FilePort:
    """A port that uses an object from the program with ``read(count)``, ``write`` and ``inWaiting``."""

    def __init__(self, file: File) -> None:
        self._file = file

    def read(self) -> bytes:
        """Return the bytes received, or b"" after a short wait. Raise PortError if the object raises an exception."""
        try:
            waiting = int(self._file.inWaiting())
            if waiting < 1:
                time.sleep(0.001)
                return b""
            return bytes(self._file.read(waiting))
        except (OSError, RuntimeError) as error:
            raise PortError(str(error)) from error

    def write(self, data: bytes) -> None:
        """Write all bytes. Raise PortError if the object raises an exception."""
        try:
            self._file.write(data)
        except (OSError, RuntimeError) as error:
            raise PortError(str(error)) from error

    def flush_input(self) -> None:
        """Discard received bytes that have not been read."""
        flush = getattr(self._file, "flushInput", None)
        if flush is not None:
            flush()

    def close(self) -> None:
        """Do nothing: the object belongs to the program."""
