"""The master's journal as bytes: one record per change, each with a length prefix and a checksum.

Pure. A file is the line ``minirospy journal 1``, then records: length (4 bytes, little-endian), CRC-32 of the rest (4
bytes), a msgpack array ``[what, argument, ...]``. Reading stops at an incomplete record, because later bytes may be
inconsistent with the records before it.
"""

from __future__ import annotations

import datetime
import struct
import zlib
from collections.abc import Callable, Iterable, Iterator
from itertools import chain
from typing import Any, NamedTuple

import msgpack  # type: ignore[import-untyped]

from minirospy.core.wire.xmlrpc import DateTime

__all__ = ["HEAD", "Recovered", "pack_in_steps", "parse_journal", "serialize_record", "unpack"]

HEAD = b"minirospy journal 1\n"

STEP_ITEMS = 500
STEP_BYTES = 65536
# Msgpack's type bytes for a long string and for long bytes; a 4-byte length follows
_TEXT_32, _BINARY_32 = b"\xdb", b"\xc6"

_FRAME = struct.Struct("<II")
_DATE, _DATE_TEXT = 1, 2


class Recovered(NamedTuple):
    """The complete records, their size in bytes including the file's first line, and a description of any fault after them."""

    records: list[list[Any]]
    size: int
    damage: str


def serialize_record(record: list[object]) -> bytes:
    """Serialize a record for the file. Raise ValueError or TypeError if msgpack cannot represent a value."""
    body = _pack(record)
    return _FRAME.pack(len(body), zlib.crc32(body)) + body


def pack_in_steps(value: object) -> Iterator[bytes]:
    """Yield a large value's packed bytes in pieces; :func:`unpack` accepts their concatenation.

    Raise ValueError or TypeError if msgpack cannot represent a value.
    """
    packer = msgpack.Packer(default=_encode_other, strict_types=True, autoreset=False)
    yield from _pack_in_steps(value, packer)
    yield packer.bytes()


def _pack_in_steps(value: object, packer: msgpack.Packer) -> Iterator[bytes]:
    if type(value) is list:
        packer.pack_array_header(len(value))
        items: Iterable[object] = value
    elif type(value) is dict:
        packer.pack_map_header(len(value))
        items = chain.from_iterable(value.items())
    elif (type(value) is str or type(value) is bytes) and len(value) > STEP_BYTES:
        yield from _pack_long(value, packer)
        return
    else:
        packer.pack(value)
        return

    for number, item in enumerate(items):
        if type(item) in (list, dict, str, bytes):
            yield from _pack_in_steps(item, packer)
        else:
            packer.pack(item)
        if number % STEP_ITEMS == STEP_ITEMS - 1 or len(packer.getbuffer()) > STEP_BYTES:
            yield _taken(packer)


def _pack_long(value: str | bytes, packer: msgpack.Packer) -> Iterator[bytes]:
    yield _taken(packer)
    size = len(value)
    if isinstance(value, str) and not value.isascii():
        size = 0
        for piece in _slices(value):
            size += len(_encoded(piece))
            yield b""
    yield (_TEXT_32 if isinstance(value, str) else _BINARY_32) + struct.pack(">I", size)
    for piece in _slices(value):
        yield _encoded(piece)


def _slices(value: str | bytes) -> Iterator[str | bytes]:
    return (value[at : at + STEP_BYTES] for at in range(0, len(value), STEP_BYTES))


def _encoded(value: str | bytes) -> bytes:
    return value.encode() if isinstance(value, str) else value


def _taken(packer: msgpack.Packer) -> bytes:
    data: bytes = packer.bytes()
    packer.reset()
    return data


def unpack(data: bytes) -> object:
    """Unpack the value packed by :func:`pack_in_steps`. Raise ValueError if the data is invalid."""
    try:
        return msgpack.unpackb(data, ext_hook=_decode_other, strict_map_key=False)
    except (msgpack.UnpackException, TypeError) as error:
        raise ValueError(f"not a packed value: {error}") from error


def parse_journal(data: bytes) -> Recovered:
    """Parse the records in ``data``, up to the first incomplete one."""
    if not data.startswith(HEAD):
        return Recovered([], 0, "it does not start as a journal" if data else "it is empty")
    records: list[list[object]] = []
    at = len(HEAD)
    while at < len(data):
        if len(data) - at < _FRAME.size:
            return Recovered(records, at, "its last record is torn")
        length, checksum = _FRAME.unpack_from(data, at)
        body = data[at + _FRAME.size : at + _FRAME.size + length]
        if len(body) < length:
            return Recovered(records, at, "its last record is torn")
        record = _unpack(body) if zlib.crc32(body) == checksum else None
        if not isinstance(record, list) or not record:
            return Recovered(records, at, f"the record at byte {at} is damaged")
        records.append(record)
        at += _FRAME.size + length
    return Recovered(records, at, "")


def _encode_other(value: object) -> object:
    if isinstance(value, datetime.datetime):
        return msgpack.ExtType(_DATE, value.isoformat().encode())
    if isinstance(value, DateTime):
        return msgpack.ExtType(_DATE_TEXT, value.value.encode())
    raise TypeError(f"a journal holds no {type(value).__name__}")


def _decode_other(code: int, data: bytes) -> object:
    if code == _DATE:
        return datetime.datetime.fromisoformat(data.decode())
    if code == _DATE_TEXT:
        return DateTime(data.decode())
    raise ValueError(f"unknown type {code}")


_pack: Callable[[object], bytes] = msgpack.Packer(default=_encode_other, strict_types=True).pack


def _unpack(body: bytes) -> object:
    try:
        return msgpack.unpackb(body, ext_hook=_decode_other, strict_map_key=False)
    except (ValueError, msgpack.UnpackException, TypeError):
        return None
