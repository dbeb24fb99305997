"""XXH3 with 128 bits, which rmw_zenoh uses to make an id of 16 bytes from a token's key. Pure.

Source: https://github.com/Cyan4973/xxHash/blob/dev/doc/xxhash_spec.md, with seed 0, for inputs of more than 16 bytes.
"""

from __future__ import annotations

import struct

__all__ = ["xxh3_128"]

_MASK = (1 << 64) - 1
_P32 = (0x9E3779B1, 0x85EBCA77, 0xC2B2AE3D)
_P64 = (0x9E3779B185EBCA87, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9, 0x85EBCA77C2B2AE63, 0x27D4EB2F165667C5)
_SECRET = bytes.fromhex(
    "b8fe6c3923a44bbe7c01812cf721ad1cded46de9839097db7240a4a4b7b3671fcb79e64eccc0e578825ad07dccff7221"
    "b8084674f743248ee03590e6813a264c3c2852bb91c300cb88d0658b1b532ea371644897a20df94e3819ef46a9deacd8"
    "a8fa763fe39c343ff9dcbbc7c70b4f1d8a51e04bcdb45931c89f7ec9d9787364eac5ac8334d3ebc3c581a0fffa1363eb"
    "170ddd51b7f0da49d316552629d4689e2b16be587d47a1fc8ff8b8d17ad031ce45cb3a8f95160428afd7fbcabb4b407e"
)
_STRIPE, _STRIPES = 64, 16


def xxh3_128(data: bytes) -> bytes:
    """Return the hash: its low half, then its high half, both little-endian. ``data`` has more than 16 bytes."""
    size = len(data)
    low, high = _long(data) if size > 240 else _middle(data, size)
    return struct.pack("<QQ", low, high)


def _middle(data: bytes, size: int) -> tuple[int, int]:
    low, high = size * _P64[0] & _MASK, 0
    if size <= 128:
        for part in reversed(range((size - 1) // 32 + 1)):
            low, high = _mixed(low, high, data, 16 * part, size - 16 * (part + 1), 32 * part)
    else:
        for start in range(0, 128, 32):
            low, high = _mixed(low, high, data, start, start + 16, start)
        low, high = _avalanche(low), _avalanche(high)
        for start in range(128, size - 31, 32):
            low, high = _mixed(low, high, data, start, start + 16, start - 125)
        low, high = _mixed(low, high, data, size - 16, size - 32, 103)
    both = low * _P64[0] + high * _P64[3] + size * _P64[1]
    return _avalanche(low + high & _MASK), -_avalanche(both & _MASK) & _MASK


def _mixed(low: int, high: int, data: bytes, one: int, other: int, secret: int) -> tuple[int, int]:
    a, b = struct.unpack_from("<QQ", data, one)
    c, d = struct.unpack_from("<QQ", data, other)
    e, f, g, h = struct.unpack_from("<4Q", _SECRET, secret)
    low = (low + _folded(a ^ e, b ^ f) & _MASK) ^ (c + d & _MASK)
    high = (high + _folded(c ^ g, d ^ h) & _MASK) ^ (a + b & _MASK)
    return low, high


def _long(data: bytes) -> tuple[int, int]:
    size = len(data)
    lanes = [_P32[2], _P64[0], _P64[1], _P64[2], _P64[3], _P32[1], _P64[4], _P32[0]]
    for stripe in range((size - 1) // _STRIPE):
        number = stripe % _STRIPES
        _accumulate(lanes, data, stripe * _STRIPE, number * 8)
        if number == _STRIPES - 1:
            keys = struct.unpack_from("<8Q", _SECRET, len(_SECRET) - _STRIPE)
            lanes = [
                (lane ^ lane >> 47 ^ key) * _P32[0] & _MASK for lane, key in zip(lanes, keys, strict=True)
            ]
    _accumulate(lanes, data, size - _STRIPE, len(_SECRET) - _STRIPE - 7)
    return (
        _merged(lanes, 11, size * _P64[0] & _MASK),
        _merged(lanes, len(_SECRET) - _STRIPE - 11, ~(size * _P64[1]) & _MASK),
    )


def _accumulate(lanes: list[int], data: bytes, start: int, secret: int) -> None:
    values = struct.unpack_from("<8Q", data, start)
    secrets = struct.unpack_from("<8Q", _SECRET, secret)
    for lane, value in enumerate(values):
        key = value ^ secrets[lane]
        lanes[lane ^ 1] = lanes[lane ^ 1] + value & _MASK
        lanes[lane] = lanes[lane] + (key & 0xFFFFFFFF) * (key >> 32) & _MASK


def _merged(lanes: list[int], secret: int, start: int) -> int:
    keys = struct.unpack_from("<8Q", _SECRET, secret)
    for lane in range(0, 8, 2):
        start += _folded(lanes[lane] ^ keys[lane], lanes[lane + 1] ^ keys[lane + 1])
    return _avalanche(start & _MASK)


def _folded(one: int, other: int) -> int:
    product = one * other
    return product & _MASK ^ product >> 64


def _avalanche(value: int) -> int:
    value = (value ^ value >> 37) * 0x165667919E3779F9 & _MASK
    return value ^ value >> 32
