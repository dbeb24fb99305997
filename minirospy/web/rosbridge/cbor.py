"""Encode and decode CBOR, with typed arrays marked by tags. Pure; needs the library cbor2.

Source: RFC 8949, RFC 8746 (typed arrays); like rosbridge, this uses the little-endian tags.
"""

from __future__ import annotations

import sys
from array import array
from collections.abc import Sequence
from io import BytesIO
from typing import Any

from minirospy.base.errors import BridgeProtocolError

__all__ = ["TYPED_ARRAYS", "decode_cbor", "encode_cbor", "typed_array"]

TYPED_ARRAYS = {
    "uint16": (69, "H"),
    "uint32": (70, "I"),
    "uint64": (71, "Q"),
    "byte": (72, "b"),
    "int8": (72, "b"),
    "int16": (77, "h"),
    "int32": (78, "i"),
    "int64": (79, "q"),
    "float32": (85, "f"),
    "float64": (86, "d"),
}
"""Dict from element type to (tag, format character) of its arrays."""

_MAX_VALUES = 1_000_000
"""Maximum number of values in a client's message. A tagged array counts as one value."""

_FORMATS = {64: "B", 68: "B", **dict(TYPED_ARRAYS.values())}


def encode_cbor(value: object) -> bytes:
    """Encode a value as CBOR. Raise BridgeProtocolError if cbor2 is not installed."""
    data: bytes = _library().dumps(value)
    return data


def decode_cbor(data: bytes) -> object:
    """Decode CBOR data; convert typed arrays to lists.

    Raise ValueError if the data is invalid, BridgeProtocolError if cbor2 is not installed.
    """
    library = _library()
    _check_heads(data)
    stream = BytesIO(data)
    try:
        value: object = library.load(stream, tag_hook=_from_tag)
    except BridgeProtocolError:
        raise
    except (library.CBORError, ValueError, TypeError, OverflowError, MemoryError) as error:
        raise ValueError(str(error) or type(error).__name__) from error
    if stream.tell() != len(data):
        raise ValueError(f"{len(data) - stream.tell()} bytes follow the value")
    return value


def _check_heads(data: bytes) -> None:
    """Raise ValueError if the data has too many values, or tags that messages do not use.

    Given other tags, cbor2 would, for example, compile regular expressions.
    """
    at = count = 0
    while at < len(data):
        major, argument = data[at] >> 5, data[at] & 31
        at += 1
        if 24 <= argument <= 27:
            size = 1 << (argument - 24)
            argument = int.from_bytes(data[at : at + size], "big")
            at += size
        elif argument == 31:
            argument = 0  # indefinite length: the parts follow
        if major in (2, 3):
            at += argument
        elif major == 6 and argument not in _FORMATS:
            raise ValueError(f"CBOR tag {argument} is not one of a message's")
        count += 1
        if count > _MAX_VALUES:
            raise ValueError(f"more than {_MAX_VALUES} values")


def typed_array(type_: str, values: Sequence[float]) -> object:
    """Return an array of numbers as bytes with a CBOR tag."""
    tag, format_ = TYPED_ARRAYS[type_]
    packed = array(format_, values)
    if sys.byteorder == "big":
        packed.byteswap()
    return _library().CBORTag(tag, packed.tobytes())


def _from_tag(first: Any, second: Any = None, *_: object) -> object:
    """Convert a typed array to a list. Old versions of cbor2 pass the decoder as first argument."""
    tag = first if hasattr(first, "tag") else second
    format_ = _FORMATS.get(tag.tag)
    if format_ is None or not isinstance(tag.value, bytes):
        raise ValueError(f"CBOR tag {tag.tag} is not one of a message's")
    if format_ == "B":
        return tag.value
    values = array(format_)
    values.frombytes(tag.value)
    if sys.byteorder == "big":
        values.byteswap()
    return values.tolist()


def _library() -> Any:
    try:
        import cbor2
    except ImportError as error:
        # Clients receive this text, so omit the install command, which contains the path of the server's interpreter.
        raise BridgeProtocolError(
            "compression cbor needs the library cbor2: install it on the server"
        ) from error
    return cbor2
