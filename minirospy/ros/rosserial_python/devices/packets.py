"""Encodes and decodes the packets on a serial line. Pure. Source: http://wiki.ros.org/rosserial/Overview/Protocol.

A packet consists of ff fe, length (2 bytes, little endian), checksum of the length, topic id (2 bytes), data, checksum of
id and data. The sum of a checksum and the bytes that it covers is 255 modulo 256.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import NamedTuple

__all__ = ["MAX_MESSAGE_LENGTH", "Decoder", "Fault", "Packet", "WrongVersion", "encode"]

_SYNC, _VERSION = 0xFF, 0xFE
_HEAD = struct.Struct("<HBH")
MAX_MESSAGE_LENGTH = 0xFFFF  # in bytes: the maximum of the packet's 16-bit length field


class Packet(NamedTuple):
    """A message for the topic with this id."""

    topic_id: int
    data: bytes


class Fault(NamedTuple):
    """A rejected packet, with the real rosserial_python's error text."""

    text: str


class WrongVersion(NamedTuple):
    """An error: the second byte belongs to another protocol version, or the data is not a packet."""

    byte: int


def _checksum(data: bytes) -> int:
    return 255 - sum(data) % 256


def encode(topic_id: int, data: bytes) -> bytes:
    """Encode a packet. Raise ValueError if the data is too long."""
    if len(data) > MAX_MESSAGE_LENGTH:
        raise ValueError(f"{len(data)} bytes: a packet holds {MAX_MESSAGE_LENGTH}")
    length, topic = struct.pack("<H", len(data)), struct.pack("<H", topic_id)
    return b"".join(
        (
            bytes((_SYNC, _VERSION)),
            length,
            bytes((_checksum(length),)),
            topic,
            data,
            bytes((_checksum(topic + data),)),
        )
    )


class Decoder:
    """Decodes packets from bytes received in chunks of any size."""

    def __init__(self) -> None:
        self._bytes = bytearray()

    @property
    def missing(self) -> int:
        """Return how many more bytes the next step needs, or 0 between packets."""
        return self._needed() - len(self._bytes) if self._bytes else 0

    @property
    def received(self) -> int:
        """Return how many bytes of the current packet have been received."""
        return len(self._bytes)

    @property
    def step(self) -> str:
        """Return the name, as in the real rosserial_python, of the part of the packet to read next."""
        count = len(self._bytes)
        for end, name in ((1, "syncflag"), (2, "protocol"), (5, "message length"), (7, "topic id")):
            if count < end:
                return name
        return "data" if self.missing > 1 else "data checksum"

    def reset(self) -> None:
        """Discard the current packet."""
        self._bytes.clear()

    def feed(self, data: bytes) -> Iterator[Packet | Fault | WrongVersion]:
        """Add bytes; yield the packets and errors that they complete."""
        self._bytes += data
        while self._bytes:
            if self._bytes[0] != _SYNC:
                start = self._bytes.find(_SYNC)
                del self._bytes[: start if start >= 0 else len(self._bytes)]
                continue
            if len(self._bytes) < self._needed():
                return
            found = self._take()
            if found is not None:
                yield found

    def _needed(self) -> int:
        """Return how many bytes of the packet must have arrived for the next step: version, length, or all the rest."""
        if len(self._bytes) < 2 or self._bytes[1] != _VERSION:
            return 2
        if len(self._bytes) < 5 or not self._has_right_length():
            return 5
        return 8 + int(_HEAD.unpack_from(bytes(self._bytes[2:7]).ljust(5, b"\0"))[0])

    def _has_right_length(self) -> bool:
        return sum(self._bytes[2:5]) % 256 == 255

    def _take(self) -> Packet | Fault | WrongVersion:
        if self._bytes[1] != _VERSION:
            version = self._bytes[1]
            del self._bytes[:2]
            return WrongVersion(version)
        length, _, topic_id = _HEAD.unpack(bytes(self._bytes[2:7]).ljust(5, b"\0"))
        if not self._has_right_length():
            del self._bytes[:5]
            return Fault(f"Wrong checksum for msg length, length {length}, dropping message.")
        covered = bytes(self._bytes[5 : 8 + length])
        del self._bytes[: 8 + length]
        if sum(covered) % 256 != 255:
            return Fault("wrong checksum for topic id and msg")
        return Packet(topic_id, covered[2:-1])
