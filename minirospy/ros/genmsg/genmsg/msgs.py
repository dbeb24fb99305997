"""genmsg.msgs: message types, fields and constants."""

from __future__ import annotations

import ast
import re
from typing import NamedTuple

from minirospy.ros.genmsg.genmsg.base import EXT_MSG, MSG_DIR, SEP, InvalidMsgSpec

__all__ = [
    "BUILTIN_TYPES",
    "DURATION",
    "DURATION_MSG",
    "EXT_MSG",
    "HEADER",
    "HEADER_FULL_NAME",
    "MSG_DIR",
    "PRIMITIVE_TYPES",
    "SEP",
    "TIME",
    "TIME_MSG",
    "Constant",
    "Field",
    "InvalidMsgSpec",
    "MsgSpec",
    "bare_msg_type",
    "is_builtin",
    "is_header_type",
    "is_valid_constant_type",
    "is_valid_msg_field_name",
    "is_valid_msg_type",
    "parse_type",
    "resolve_type",
]

HEADER = "Header"
TIME = "time"
DURATION = "duration"
TIME_MSG = "uint32 secs\nuint32 nsecs"
DURATION_MSG = "int32 secs\nint32 nsecs"
HEADER_FULL_NAME = "std_msgs/Header"

PRIMITIVE_TYPES = [
    "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float32", "float64", "string", "bool",
    "char", "byte",
]  # fmt: skip

BUILTIN_TYPES = [*PRIMITIVE_TYPES, "time", "duration"]
RANGES = {
    **{f"int{bits}": (-(1 << bits - 1), (1 << bits - 1) - 1) for bits in (8, 16, 32, 64)},
    **{f"uint{bits}": (0, (1 << bits) - 1) for bits in (8, 16, 32, 64)},
    "byte": (-128, 127),
    "char": (0, 255),
}
_HEADERS = ("Header", HEADER_FULL_NAME, "roslib/Header")


class _Constant(NamedTuple):
    type: str
    name: str
    val: object
    val_text: str


class Constant(_Constant):
    """A constant; ``val`` is its value, ``val_text`` the value as written in the definition.

    Raise ValueError if an argument is None.
    """

    __slots__ = ()

    def __new__(cls, type: str, name: str, val: object, val_text: str) -> Constant:
        if any(each is None for each in (type, name, val, val_text)):
            raise ValueError("Constant must have non-None parameters")
        return super().__new__(cls, type, name, val, val_text)

    def __repr__(self) -> str:
        return f"{self.type} {self.name}={self.val}"


class Field:
    """A field, with its parsed type."""

    def __init__(self, name: str, type: str) -> None:
        self.name = name
        self.type = type
        self.base_type, self.is_array, self.array_len = parse_type(type)
        self.is_header = is_header_type(type)
        self.is_builtin = is_builtin(self.base_type)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Field) and (self.name, self.type) == (other.name, other.type)

    def __hash__(self) -> int:
        return hash((self.name, self.type))

    def __repr__(self) -> str:
        return f"[{self.name}, {self.type}, {self.base_type}, {self.is_array}, {self.array_len}]"


class MsgSpec:
    """A message specification: the fields' ``types`` and ``names``, the constants, text and name."""

    def __init__(
        self,
        types: list[str],
        names: list[str],
        constants: list[Constant],
        text: str,
        full_name: str,
        package: str = "",
        short_name: str = "",
    ) -> None:
        if len(types) != len(names):
            raise ValueError(f"len of args must match: {len(types)} types, {len(names)} names")
        if len(set(names)) != len(names):
            raise InvalidMsgSpec(f"Duplicate field names in message: {names}")

        self.types = types
        self.names = names
        self.constants = constants
        self.text = text
        self.full_name = full_name

        own_package, _, own_name = full_name.rpartition("/")
        self.package = package or own_package
        self.short_name = short_name or own_name
        self.header_present = self.has_header()

    def fields(self) -> list[tuple[str, str]]:
        """Return each field's (type, name)."""
        return list(zip(self.types, self.names, strict=True))

    def parsed_fields(self) -> list[Field]:
        """Return the fields with their types parsed."""
        return [Field(name, type_) for type_, name in self.fields()]

    def has_header(self) -> bool:
        """Return whether the first field is a header, which publishers fill in."""
        return self.fields()[:1] == [(HEADER_FULL_NAME, "header")]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, MsgSpec) and (self.fields(), self.constants, self.text, self.full_name) == (
            other.fields(),
            other.constants,
            other.text,
            other.full_name,
        )

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        constants = f"{self.constants}, " if self.constants else ""
        return f"MsgSpec[{constants}{self.types}, {self.names}]"

    def __str__(self) -> str:
        return self.text


def is_builtin(msg_type_name: str) -> bool:
    """Return whether a type is built-in, not a message type."""
    return msg_type_name in BUILTIN_TYPES


def is_header_type(msg_type: str) -> bool:
    """Return whether a type is one of the names for std_msgs/Header."""
    return msg_type in _HEADERS


def is_valid_msg_type(x: str) -> bool:
    """Return whether a string is a valid type name, with or without array brackets."""
    return bool(x) and re.match(r"(?!.*//)[A-Za-z][\w/]*(\[\d*\])*\Z", x, re.ASCII) is not None


def is_valid_msg_field_name(x: str | None) -> bool:
    """Return whether a string is a valid field name."""
    return x is not None and re.match(r"[A-Za-z]\w*\Z", x, re.ASCII) is not None


def is_valid_constant_type(x: str) -> bool:
    """Return whether a constant can have this type."""
    return x in PRIMITIVE_TYPES


def bare_msg_type(msg_type: str) -> str:
    """Return a type without its array brackets."""
    return msg_type[: msg_type.index("[")] if msg_type and "[" in msg_type else msg_type


def resolve_type(msg_type: str, package_context: str) -> str:
    """Return a type's full name, resolved in the package ``package_context``."""
    bare = bare_msg_type(msg_type)
    if "/" in bare or is_builtin(bare):
        return msg_type
    # Keep array brackets after Header; ROS's genmsg drops them.
    return f"std_msgs/{msg_type}" if bare == "Header" else f"{package_context}/{msg_type}"


def parse_type(msg_type: str) -> tuple[str, bool, int | None]:
    """Return (base type, whether it is an array, the array's fixed length or None). Raise ValueError if the type is invalid."""
    if not msg_type:
        raise ValueError("Invalid empty type")
    if "[" not in msg_type:
        return msg_type, False, None
    base, _, rest = msg_type.partition("[")
    if "[" in rest:
        raise ValueError(f"Currently only support 1-dimensional array types: {msg_type}")
    length = rest.removesuffix("]")
    if not rest.endswith("]") or (length and not length.isdecimal()):
        raise ValueError(f"Invalid array dimension: [{length}]")
    return base, True, int(length) if length else None


def why_invalid(text: str) -> str | None:
    """Return genmsg's message for the first error in a definition, or None if genmsg finds no error."""
    names: list[str] = []
    for line in text.splitlines():
        bare = line.split("#")[0].strip()
        if not bare:
            continue
        why = _why_no_constant(bare) if "=" in bare else _why_no_field(bare, line, names)
        if why:
            return why
    return f"Duplicate field names in message: {names}" if len(set(names)) != len(names) else None


def _why_no_field(bare: str, line: str, names: list[str]) -> str | None:
    words = bare.split()
    if len(words) != 2:
        return f"Invalid declaration: {line}"
    type_, name = words
    if not is_valid_msg_field_name(name):
        return f"{name} is not a legal message field name"
    if not is_valid_msg_type(type_):
        return f"{type_} is not a legal message field type"
    try:
        parse_type(type_)
    except ValueError as error:
        return f"invalid field: {error}"
    names.append(name)
    return None


def _why_no_constant(bare: str) -> str | None:
    type_, _, declared = bare.partition(" ")
    if not is_valid_constant_type(type_):
        return f"{type_} is not a legal constant type"
    try:
        _check_value(type_, declared.partition("=")[2].strip())
    except (ValueError, SyntaxError) as error:
        return f"Invalid constant value: {error}"
    return None


def _check_value(type_: str, value: str) -> None:
    if type_ in ("float32", "float64"):
        float(value)
    elif type_ == "bool":
        ast.literal_eval(value)
    elif type_ in RANGES:
        low, high = RANGES[type_]
        if not low <= int(value) <= high:
            raise ValueError(f"cannot coerce [{value}] to {type_} (out of bounds)")
