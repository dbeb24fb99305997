"""The functions of rosbag.bag that read and write records, for programs that repair bags.

minirospy's own reader and writer are in ``core/bag/``. Source: http://wiki.ros.org/Bags/Format/2.0, and the behaviour of
rosbag.bag.
"""

from __future__ import annotations

import io
import math
import os
import struct
import time
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, BinaryIO, TypeVar

from minirospy.ros.rosbag.rosbag.exceptions import ROSBagException, ROSBagFormatException
from minirospy.ros.rosbag.rosbag.internals import make_time

if TYPE_CHECKING:
    from minirospy.base import times
    from minirospy.client.time import Time

__all__ = [
    "_CHUNK_INDEX_VERSION",
    "_FILE_HEADER_LENGTH",
    "_INDEX_VERSION",
    "_OP_CHUNK",
    "_OP_CHUNK_INFO",
    "_OP_CODES",
    "_OP_CONNECTION",
    "_OP_FILE_HEADER",
    "_OP_INDEX_DATA",
    "_OP_MSG_DATA",
    "_OP_MSG_DEF",
    "_VERSION",
    "_build_header_from_str",
    "_decode_bytes",
    "_decode_str",
    "_median",
    "_pack_time",
    "_pack_uint8",
    "_pack_uint32",
    "_pack_uint64",
    "_peek_next_header_op",
    "_read",
    "_read_bytes_field",
    "_read_field",
    "_read_header",
    "_read_record_data",
    "_read_sized",
    "_read_str_field",
    "_read_time",
    "_read_time_field",
    "_read_uint8",
    "_read_uint8_field",
    "_read_uint32",
    "_read_uint32_field",
    "_read_uint64",
    "_read_uint64_field",
    "_skip_record",
    "_skip_sized",
    "_time_to_str",
    "_unpack_time",
    "_unpack_uint8",
    "_unpack_uint32",
    "_unpack_uint64",
    "_write_header",
    "_write_record",
    "_write_sized",
]

_OP_MSG_DEF = 1
_OP_MSG_DATA = 2
_OP_FILE_HEADER = 3
_OP_INDEX_DATA = 4
_OP_CHUNK = 5
_OP_CHUNK_INFO = 6
_OP_CONNECTION = 7
_OP_CODES = {
    _OP_MSG_DEF: "MSG_DEF",
    _OP_MSG_DATA: "MSG_DATA",
    _OP_FILE_HEADER: "FILE_HEADER",
    _OP_INDEX_DATA: "INDEX_DATA",
    _OP_CHUNK: "CHUNK",
    _OP_CHUNK_INFO: "CHUNK_INFO",
    _OP_CONNECTION: "CONNECTION",
}
_VERSION = "#ROSBAG V2.0"
_INDEX_VERSION = 1
_CHUNK_INDEX_VERSION = 1
_FILE_HEADER_LENGTH = 4096  # bytes of the file header's fields and padding together

Header = dict[str, bytes]
_T = TypeVar("_T")


# --- values


def _pack_uint8(v: int) -> bytes:
    return struct.pack("<B", v)


def _pack_uint32(v: int) -> bytes:
    return struct.pack("<L", v)


def _pack_uint64(v: int) -> bytes:
    return struct.pack("<Q", v)


def _pack_time(v: times.Time) -> bytes:
    return struct.pack("<LL", v.secs, v.nsecs)


def _unpack_uint8(v: bytes) -> int:
    value: int = struct.unpack("<B", v)[0]
    return value


def _unpack_uint32(v: bytes) -> int:
    value: int = struct.unpack("<L", v)[0]
    return value


def _unpack_uint64(v: bytes) -> int:
    value: int = struct.unpack("<Q", v)[0]
    return value


def _unpack_time(v: bytes) -> Time:
    secs, nsecs = struct.unpack("<LL", v)
    return make_time()(secs * 1_000_000_000 + nsecs)


def _decode_bytes(v: bytes) -> bytes:
    return v


def _decode_str(v: str | bytes) -> str:
    return v if isinstance(v, str) else v.decode()


def _median(values: Sequence[float]) -> float:
    """Return the median, or NaN if there are no values."""
    if not values:
        return math.nan
    ordered, middle = sorted(values), len(values) // 2
    return ordered[middle] if len(values) % 2 else (ordered[middle - 1] + ordered[middle]) / 2


def _time_to_str(secs: float) -> str:
    """Format a time like `rosbag info`."""
    hundredths = f"{secs % 1:.2f}"[1:]
    return time.strftime("%b %d %Y %H:%M:%S", time.localtime(secs)) + hundredths


# --- reading


def _read(f: BinaryIO, size: int) -> bytes:
    """Return exactly ``size`` bytes. Raise ROSBagException at the end of the file."""
    data = f.read(size)
    if len(data) != size:
        raise ROSBagException(f"expecting {size} bytes, read {len(data)}")
    return data


def _read_uint8(f: BinaryIO) -> int:
    return _unpacked(f.read(1), "uint8", _unpack_uint8)


def _read_uint32(f: BinaryIO) -> int:
    return _unpacked(f.read(4), "uint32", _unpack_uint32)


def _read_uint64(f: BinaryIO) -> int:
    return _unpacked(f.read(8), "uint64", _unpack_uint64)


def _read_time(f: BinaryIO) -> Time:
    return _unpacked(f.read(8), "time", _unpack_time)


def _unpacked(data: bytes, name: str, unpack: Callable[[bytes], _T]) -> _T:
    try:
        return unpack(data)
    except struct.error as error:
        raise ROSBagFormatException(f"error unpacking {name}: {error}") from error


def _read_sized(f: BinaryIO) -> bytes:
    """Read a length prefix and return the bytes that follow.

    Raise ROSBagException or ROSBagFormatException at the end of the file.
    """
    return _read(f, _read_uint32(f))


def _skip_sized(f: BinaryIO) -> None:
    """Read a length prefix and skip the bytes that follow it."""
    f.seek(_read_uint32(f), os.SEEK_CUR)


def _skip_record(f: BinaryIO) -> None:
    """Skip a record: its header and its data."""
    _skip_sized(f)
    _skip_sized(f)


def _read_record_data(f: BinaryIO) -> bytes:
    """Return a record's data after its header was read. Raise ROSBagFormatException if the data is incomplete."""
    try:
        return _read_sized(f)
    except ROSBagException as error:
        raise ROSBagFormatException(f"Error reading record data: {error}") from error


def _read_header(f: BinaryIO, req_op: int | None = None) -> Header:
    """Return a record's header. Raise ROSBagFormatException if it is invalid or its operation is not ``req_op``."""
    try:
        data = _read_sized(f)
    except ROSBagException as error:
        raise ROSBagFormatException(f"Error reading header: {error}") from error
    return _build_header_from_str(data, req_op)


def _build_header_from_str(header_str: bytes, req_op: int | None) -> Header:
    header: Header = {}
    while header_str:
        if len(header_str) < 4:
            raise ROSBagFormatException("Error reading header field")
        size, rest = _unpack_uint32(header_str[:4]), len(header_str) - 4
        if rest < size:
            raise ROSBagFormatException(f"Error reading header field: expected {size} bytes, read {rest}")
        end = 4 + _unpack_uint32(header_str[:4])
        name, equals, value = header_str[4:end].partition(b"=")
        if not equals:
            raise ROSBagFormatException("Error reading header field")
        header[name.decode()] = value
        header_str = header_str[end:]
    if req_op is not None:
        op = _read_uint8_field(header, "op")
        if op != req_op:
            raise ROSBagFormatException(f"Expected op code: {_OP_CODES[req_op]}, got {_OP_CODES.get(op, op)}")
    return header


def _peek_next_header_op(f: BinaryIO) -> int:
    """Return the next record's operation without moving the file position."""
    position = f.tell()
    header = _read_header(f)
    op = _read_uint8_field(header, "op")
    f.seek(position)
    return op


def _read_field(header: Mapping[str, bytes], field: str, unpack_fn: Callable[[bytes], _T]) -> _T:
    """Return a header field's value. Raise ROSBagFormatException if the field is missing or invalid."""
    if field not in header:
        raise ROSBagFormatException(f'expected "{field}" field in record')
    try:
        return unpack_fn(header[field])
    except (struct.error, UnicodeDecodeError) as error:
        raise ROSBagFormatException(f'error reading field "{field}": {error}') from error


def _read_bytes_field(header: Mapping[str, bytes], field: str) -> bytes:
    return _read_field(header, field, _decode_bytes)


def _read_str_field(header: Mapping[str, bytes], field: str) -> str:
    return _read_field(header, field, _decode_str)


def _read_uint8_field(header: Mapping[str, bytes], field: str) -> int:
    return _read_field(header, field, _unpack_uint8)


def _read_uint32_field(header: Mapping[str, bytes], field: str) -> int:
    return _read_field(header, field, _unpack_uint32)


def _read_uint64_field(header: Mapping[str, bytes], field: str) -> int:
    return _read_field(header, field, _unpack_uint64)


def _read_time_field(header: Mapping[str, bytes], field: str) -> Time:
    return _read_field(header, field, _unpack_time)


# --- writing


def _write_sized(f: BinaryIO, v: bytes | str) -> None:
    """Write bytes with a length prefix."""
    data = v.encode() if isinstance(v, str) else v
    f.write(_pack_uint32(len(data)))
    f.write(data)


def _write_header(f: BinaryIO, header: Mapping[str, bytes | str]) -> bytes:
    """Write a record's header with its length; return the header's bytes."""
    buffer = io.BytesIO()
    for name, value in header.items():
        _write_sized(buffer, f"{name}=".encode() + (value.encode() if isinstance(value, str) else value))
    data = buffer.getvalue()
    _write_sized(f, data)
    return data


def _write_record(
    f: BinaryIO, header: Mapping[str, bytes | str], data: bytes | str = "", padded_size: int | None = None
) -> None:
    """Write a record. If ``padded_size`` is given, pad the data with spaces so that header and data have that size."""
    written = _write_header(f, header)
    if padded_size is not None:
        data = " " * max(0, padded_size - len(written))
    _write_sized(f, data)
