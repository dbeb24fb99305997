"""Converts parameters between ROS 1 and a ROS 2 node: their names, types and values. Pure.

Sources: http://wiki.ros.org/Parameter%20Server; rcl_interfaces/msg/ParameterType and ParameterValue.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Iterator, Sequence
from enum import Enum
from typing import NamedTuple
from xmlrpc.client import Binary

from minirospy.base.errors import BridgeError

__all__ = [
    "FIELDS",
    "ParameterService",
    "Value",
    "leaves",
    "listed",
    "ros1_name",
    "ros1_value",
    "ros2_name",
    "ros2_value",
]

FIELDS = (
    "",
    "bool_value",
    "integer_value",
    "double_value",
    "string_value",
    "byte_array_value",
    "bool_array_value",
    "integer_array_value",
    "double_array_value",
    "string_array_value",
)
"""The names of the ParameterValue fields, indexed by ROS 2 parameter type."""

_BYTES, _STRINGS = 5, 9
_SINGLE: dict[type, int] = {bool: 1, int: 2, float: 3, str: 4}
_ARRAY_OF_SINGLE = 5
_MIN_INT, _MAX_INT = -(2**31), 2**31 - 1


class ParameterService(Enum):
    """The parameter services that each ROS 2 node provides, with their types in rcl_interfaces."""

    LIST = "list_parameters", "ListParameters"
    GET = "get_parameters", "GetParameters"
    TYPES = "get_parameter_types", "GetParameterTypes"
    DESCRIBE = "describe_parameters", "DescribeParameters"
    SET = "set_parameters", "SetParameters"
    SET_ATOMICALLY = "set_parameters_atomically", "SetParametersAtomically"

    def __init__(self, service: str, type_: str) -> None:
        self.service = service
        self.type = type_


class Value(NamedTuple):
    """A ROS 2 parameter value. ``type`` is an index of FIELDS, or 0 if the parameter is not set."""

    type: int
    value: object = None


def ros2_name(name: str) -> str:
    """Convert a parameter name to ROS 2: ``/robot/speed`` becomes ``robot.speed``."""
    return name.strip("/").replace("/", ".")


def ros1_name(name: str) -> str:
    """Convert a parameter name to ROS 1: ``robot.speed`` becomes ``/robot/speed``."""
    return "/" + name.strip("./").replace(".", "/")


def leaves(value: object, name: str = "") -> Iterator[str]:
    """Yield the names of all parameters in the value of a namespace."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from leaves(inner, f"{name}/{key}")
    elif name:
        yield name


def ros2_value(value: object) -> Value:
    """Convert a ROS 1 value to ROS 2, as a JSON string if ROS 2 has no such type."""
    if isinstance(value, Binary):
        value = value.data
    if isinstance(value, bytes | bytearray):
        return Value(_BYTES, [bytes((each,)) for each in value])
    single = _SINGLE.get(type(value))
    if single is not None:
        return Value(single, value)
    if isinstance(value, list):
        kinds = {type(each) for each in value}
        if not kinds:
            return Value(_STRINGS, [])
        if kinds == {int, float}:
            return Value(_SINGLE[float] + _ARRAY_OF_SINGLE, [float(each) for each in value])
        inner = _SINGLE.get(kinds.pop()) if len(kinds) == 1 else None
        if inner is not None:
            return Value(inner + _ARRAY_OF_SINGLE, list(value))
    return Value(_SINGLE[str], json.dumps(value, default=str))


def ros1_value(value: Value) -> object:
    """Convert a ROS 2 value to ROS 1. Raise BridgeError if ROS 1 has no such type."""
    if value.type == _BYTES and isinstance(value.value, Collection):
        return Binary(b"".join(each if isinstance(each, bytes) else bytes((each,)) for each in value.value))
    if 0 < value.type <= _ARRAY_OF_SINGLE:
        return _checked(value.value)
    if _ARRAY_OF_SINGLE < value.type < len(FIELDS) and isinstance(value.value, Collection):
        return [_checked(each) for each in value.value]
    raise BridgeError("a parameter of this type cannot be set in ROS 1")


def _checked(value: object) -> object:
    if isinstance(value, int) and not isinstance(value, bool) and not _MIN_INT <= value <= _MAX_INT:
        raise BridgeError(f"{value} does not fit into the 32 bits of an integer in ROS 1")
    return value


def listed(names: Sequence[str], prefixes: Sequence[str], depth: int) -> tuple[list[str], list[str]]:
    """Return the names and prefixes selected by a list request, up to ``depth`` levels below a prefix (0: no limit)."""
    found = []
    for name in names:
        rests = [name] if not prefixes else []
        rests += ["" for prefix in prefixes if name == prefix]
        rests += [name[len(prefix) + 1 :] for prefix in prefixes if name.startswith(f"{prefix}.")]
        if any(not depth or rest.count(".") < depth for rest in rests):
            found.append(name)
    return found, sorted({name.rpartition(".")[0] for name in found if "." in name})
