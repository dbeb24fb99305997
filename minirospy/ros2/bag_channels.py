"""Convert channels of ROS 2 MCAP files to ROS 1, using the definitions in the file. Pure.

Source: https://mcap.dev/spec/registry (encodings ``cdr`` and ``ros2msg``); for the syntax of definitions,
https://docs.ros.org/en/rolling/Concepts/Basic/About-Interfaces.html.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import NamedTuple

from minirospy.base.errors import DefinitionError
from minirospy.core.idl.load import get_message_class, specs_of_text
from minirospy.core.idl.spec import MessageSpec
from minirospy.ros2.layouts import TypesDiffer, ros2_spec, transcoder
from minirospy.ros2.rules import BUILT_IN

__all__ = ["Ros1Channel", "ros1_channel"]

_SEPARATOR = re.compile(r"^={10,}\s*$", re.MULTILINE)
_FIELD = re.compile(
    r"(?P<base>[A-Za-z][\w/]*)(?:<=\d+)?(?P<array>\[(?:<=)?\d{0,9}\])?\s+(?P<name>[A-Za-z]\w*)(?:\s*(?P<constant>=).*|\s+.*)?",
    re.ASCII,
)
_PRIMITIVES = {
    *("bool", "byte", "char", "float32", "float64", "string", "wstring"),
    *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)),
}
_TIME = {"sec": "int32", "nanosec": "uint32"}


class Ros1Channel(NamedTuple):
    """A channel converted to ROS 1: its type, md5sum, definition, and a function that converts the messages' bytes."""

    type: str
    md5sum: str
    definition: str
    to_ros1: Callable[[bytes | memoryview], bytes]


def ros1_channel(type_: str, schema_encoding: str, schema: bytes, message_encoding: str) -> Ros1Channel:
    """Return how to convert a channel of the ROS 2 type ``pkg/msg/Name`` to ROS 1.

    Raise MinirospyError, with the reason, if the encoding, type or definition cannot be converted.
    """
    if message_encoding != "cdr":
        raise TypesDiffer(f"its messages have the encoding '{message_encoding[:20]}', not cdr")
    if schema_encoding != "ros2msg":
        raise TypesDiffer(f"its definition has the encoding '{schema_encoding[:20]}', not ros2msg")
    ros2_name = _short(type_)
    specs2 = _ros2_specs(ros2_name, schema.decode("utf-8", "replace"))
    ros1_name = BUILT_IN.ros1_message(ros2_name)
    message_class = get_message_class(ros1_name)
    if message_class is None:
        raise TypesDiffer(f"[{ros1_name}] is not among ROS 1's types here: add its package to the workspace")
    text = message_class._full_text
    specs1 = specs_of_text(ros1_name, text)
    made = transcoder(specs1[ros1_name], _lookup(specs1), specs2[ros2_name], _lookup(specs2), BUILT_IN)
    return Ros1Channel(ros1_name, message_class._md5sum, text, made.to_ros1)


def _lookup(specs: Mapping[str, MessageSpec]) -> Callable[[str], MessageSpec]:
    def find(name: str) -> MessageSpec:
        try:
            return specs[name]
        except KeyError:
            raise TypesDiffer(f"the definition of [{name}] is missing") from None

    return find


def _short(name: str) -> str:
    """Return ``pkg/Name`` for a type written as ``pkg/msg/Name``."""
    package, _, rest = name.partition("/")
    return f"{package}/{rest.rpartition('/')[2]}"


def _ros2_specs(name: str, text: str) -> dict[str, MessageSpec]:
    """Return the specs in a schema's text: of the type itself, and of all types that it uses."""
    specs = {
        each: ros2_spec(each, _TIME) for each in ("builtin_interfaces/Time", "builtin_interfaces/Duration")
    }
    for number, part in enumerate(_SEPARATOR.split(text)):
        body = part.lstrip("\r\n")
        if number:
            head, _, body = body.partition("\n")
            if not head.startswith("MSG:"):
                raise DefinitionError(name, 1, f"'{head[:40]}' is not the name of a definition")
            specs_name = _short(head.removeprefix("MSG:").strip())
        else:
            specs_name = name
        specs[specs_name] = ros2_spec(specs_name, _fields(specs_name, body))
    return specs


def _fields(name: str, body: str) -> dict[str, str]:
    """Parse the fields of a definition; return their types in the syntax of rclpy's classes."""
    package = name.partition("/")[0]
    found: dict[str, str] = {}
    for number, line in enumerate(body.splitlines(), 1):
        text = line.partition("#")[0].strip()
        if not text:
            continue
        match = _FIELD.fullmatch(text)
        if not match:
            raise DefinitionError(name, number, f"'{text[:40]}' is not a field")
        if match["constant"]:
            continue
        base, array = match["base"], match["array"] or ""
        type_ = base if base in _PRIMITIVES or "/" in base else f"{package}/{base}"
        length = array.strip("[]")
        if array and not length:
            type_ = f"sequence<{type_}>"
        elif length.startswith("<="):
            type_ = f"sequence<{type_}, {length.removeprefix('<=')}>"
        elif array:
            type_ = f"{type_}[{length}]"
        found[match["name"]] = type_
    return found
