"""Values encoded in CDR by a type's fields, compared with rosbags."""

from __future__ import annotations

from typing import Any

import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from minirospy.base.errors import DeserializationError
from minirospy.core.idl.type_hash import Fields
from minirospy.ros2.cdr_values import decode, encode
from minirospy.ros2.definitions import Definitions
from minirospy.ros2.rules import BUILT_IN
from tests.ros2.ros2_definitions import catalogue

STORE: Any = get_typestore(Stores.ROS2_KILTED)
INNER = "uint8 small\nfloat64 large\n"
OUTER = """bool flag
string[] names
int16[3] fixed
a/Inner[] inner
uint8[] data
float64[] none
int64 last
string end
"""
STORE.register({**get_types_from_msg(INNER, "a/msg/Inner"), **get_types_from_msg(OUTER, "a/msg/Outer")})
FIELDS: dict[str, Fields] = {
    "a/Inner": {"small": "uint8", "large": "double"},
    "a/Outer": {
        "flag": "boolean",
        "names": "sequence<string>",
        "fixed": "int16[3]",
        "inner": "sequence<a/Inner, 5>",
        "data": "sequence<octet>",
        "none": "sequence<double>",
        "last": "int64",
        "end": "string",
    },
    "a/Empty": {},
}
VALUES: dict[str, object] = {
    "flag": True,
    "names": ["", "two", "drei"],
    "fixed": [-1, 2, 300],
    "inner": [{"small": 1, "large": 0.5}, {"small": 2, "large": -0.25}],
    "data": b"\1\2\3",
    "none": [],
    "last": -(2**40),
    "end": "ü",
}


def of_rosbags(*, little_endian: bool = True) -> bytes:
    import numpy as np

    inner = [STORE.types["a/msg/Inner"](1, 0.5), STORE.types["a/msg/Inner"](2, -0.25)]
    message = STORE.types["a/msg/Outer"](
        flag=True,
        names=["", "two", "drei"],
        fixed=np.array([-1, 2, 300], np.int16),
        inner=inner,
        data=np.array([1, 2, 3], np.uint8),
        none=np.array([], np.float64),
        last=-(2**40),
        end="ü",
    )
    return bytes(STORE.serialize_cdr(message, "a/msg/Outer", little_endian=little_endian))


def test_values_are_written_as_rosbags_does() -> None:
    assert encode("a/Outer", FIELDS.__getitem__, VALUES) == of_rosbags()


@pytest.mark.parametrize("little_endian", [True, False])
def test_values_of_both_byte_orders_are_read(little_endian: bool) -> None:
    data = of_rosbags(little_endian=little_endian)
    assert decode("a/Outer", FIELDS.__getitem__, data) == VALUES


def test_fields_without_a_value_are_zero() -> None:
    empty = encode("a/Outer", FIELDS.__getitem__, {})
    found = decode("a/Outer", FIELDS.__getitem__, empty)
    assert found == {
        "flag": False, "names": [], "fixed": [0, 0, 0], "inner": [], "data": b"", "none": [], "last": 0, "end": "",
    }  # fmt: skip
    assert encode("a/Empty", FIELDS.__getitem__, {}) == b"\0\1\0\0\0"


def test_parameters_are_written_as_rosbags_does() -> None:
    fields = Definitions(BUILT_IN, catalogue()).fields
    made = STORE.types["rcl_interfaces/msg/SetParametersResult"](False, "no")
    expected = bytes(STORE.serialize_cdr(made, "rcl_interfaces/msg/SetParametersResult"))
    values = {"successful": False, "reason": "no"}
    assert encode("rcl_interfaces/SetParametersResult", fields, values) == expected
    response = encode("rcl_interfaces/srv/SetParametersAtomically_Response", fields, {"result": values})
    assert response == expected


def test_each_part_of_a_message_is_refused() -> None:
    whole = of_rosbags()
    for cut in range(len(whole)):
        with pytest.raises(DeserializationError):
            decode("a/Outer", FIELDS.__getitem__, whole[:cut])


@pytest.mark.parametrize("header", [b"\0\3\0\0", b"\0\x0b\0\0", b"", b"\1\1\0\0"])
def test_another_encoding_is_refused(header: bytes) -> None:
    with pytest.raises(DeserializationError, match="not plain CDR"):
        decode("a/Outer", FIELDS.__getitem__, header + of_rosbags()[4:])


def test_a_length_beyond_the_message_is_refused_without_room_for_it() -> None:
    fields: dict[str, Fields] = {
        "a/Many": {"each": "sequence<a/Empty>"}, "a/Empty": {}, "a/Numbers": {"each": "sequence<double>"},
    }  # fmt: skip
    for name in ("a/Many", "a/Numbers"):
        with pytest.raises(DeserializationError):
            decode(name, fields.__getitem__, b"\0\1\0\0" + b"\xff\xff\xff\xff" + bytes(100))
