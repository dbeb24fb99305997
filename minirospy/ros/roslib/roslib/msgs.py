"""roslib.msgs: types and definitions in the form that preceded genmsg, and a table of definitions keyed by name."""

from __future__ import annotations

import ast
import os
import sys
from collections.abc import Sequence
from io import StringIO
from typing import TextIO

from minirospy.core.idl.load import Catalogue
from minirospy.ros.genmsg.genmsg import msgs as genmsg
from minirospy.ros.genmsg.genmsg.msgs import (
    BUILTIN_TYPES,
    DURATION,
    DURATION_MSG,
    HEADER,
    PRIMITIVE_TYPES,
    TIME,
    TIME_MSG,
    is_builtin,
    is_valid_constant_type,
    is_valid_msg_type,
)
from minirospy.ros.roslib.roslib.packages import InvalidROSPkgException, resource_file
from minirospy.workspace.packages import Packages

__all__ = [
    "BUILTIN_TYPES",
    "COMMENTCHAR",
    "CONSTCHAR",
    "DURATION",
    "DURATION_MSG",
    "EXT",
    "EXTENDED_BUILTINS",
    "HEADER",
    "PRIMITIVE_TYPES",
    "REGISTERED_TYPES",
    "RESERVED_TYPES",
    "SEP",
    "TIME",
    "TIME_MSG",
    "VERBOSE",
    "Constant",
    "Field",
    "MsgSpec",
    "MsgSpecException",
    "_convert_val",
    "_init",
    "_msg_filter",
    "_strify_spec",
    "base_msg_type",
    "get_pkg_msg_specs",
    "get_registered",
    "is_builtin",
    "is_header_type",
    "is_registered",
    "is_valid_constant_type",
    "is_valid_msg_field_name",
    "is_valid_msg_type",
    "is_verbose",
    "list_msg_types",
    "load_by_type",
    "load_from_file",
    "load_from_string",
    "load_package",
    "load_package_dependencies",
    "msg_file",
    "parse_type",
    "register",
    "reinit",
    "resolve_type",
    "set_verbose",
]

VERBOSE = False
EXT = ".msg"
SEP = "/"
CONSTCHAR = "="
COMMENTCHAR = "#"
RESERVED_TYPES = [*BUILTIN_TYPES, HEADER]


class MsgSpecException(Exception):
    """Raised if a definition cannot be read."""


class Constant:
    """A message constant: ``type``, ``name``, ``val``, and ``val_text``, the value as written in the definition."""

    __slots__ = ["name", "type", "val", "val_text"]

    def __init__(self, type_: str, name: str, val: object, val_text: str) -> None:
        if name is None or val is None or val_text is None:
            raise ValueError("Constant must have non-None parameters")
        self.type = type_
        self.name = name.strip()
        self.val = val
        self.val_text = val_text

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Constant):
            return False
        return (self.type, self.name, self.val) == (other.type, other.name, other.val)

    def __hash__(self) -> int:
        return hash((self.type, self.name))

    def __repr__(self) -> str:
        return f"{self.type} {self.name}={self.val}"


class Field:
    """A message field: ``name``, ``type``, and the values returned by `parse_type` for the type."""

    def __init__(self, name: str, type: str) -> None:
        self.name = name
        self.type = type
        self.base_type, self.is_array, self.array_len = parse_type(type)
        self.is_header = is_header_type(self.base_type)
        self.is_builtin = is_builtin(self.base_type)

    def __repr__(self) -> str:
        return f"[{self.name}, {self.type}, {self.base_type}, {self.is_array}, {self.array_len}]"


class MsgSpec:
    """A message definition: its fields' ``types`` and ``names``, its ``constants`` and its ``text``."""

    def __init__(
        self,
        types: Sequence[str],
        names: Sequence[str],
        constants: Sequence[Constant],
        text: str,
        full_name: str = "",
        short_name: str = "",
        package: str = "",
    ) -> None:
        """Create a definition. Raise MsgSpecException if two fields have the same name."""
        if len(set(names)) != len(names):
            raise MsgSpecException(f"Duplicate field names in message: {names}")
        assert len(types) == len(names), f"len({types}) != len({names})"
        self.types = types
        self.names = names
        self.constants = constants
        self.header_present = bool(types) and is_header_type(types[0]) and names[0] == "header"
        self.text = text
        self.full_name = full_name
        self.short_name = short_name
        self.package = package
        self._parsed_fields = [Field(name, type_) for name, type_ in zip(names, types, strict=True)]

    def fields(self) -> list[tuple[str, str]]:
        """Return (type, name) for each field."""
        return list(zip(self.types, self.names, strict=True))

    def parsed_fields(self) -> list[Field]:
        """Return the fields as Field objects."""
        return self._parsed_fields

    def has_header(self) -> bool:
        """Return whether the first field is `Header header`."""
        return self.header_present

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, MsgSpec):
            return False
        ours, theirs = ((each.types, each.names, each.constants, each.text) for each in (self, other))
        return ours == theirs

    def __hash__(self) -> int:
        return hash(self.text)

    def __repr__(self) -> str:
        constants = f"{self.constants!r}, " if self.constants else ""
        return f"MsgSpec[{constants}{self.types!r}, {self.names!r}]"

    def __str__(self) -> str:
        return _strify_spec(self)


def is_verbose() -> bool:
    """Return whether functions that load definitions print their progress."""
    return VERBOSE


def set_verbose(v: bool) -> None:
    """Set whether functions that load definitions print their progress."""
    global VERBOSE  # noqa: PLW0603 - programs read it
    VERBOSE = v


def base_msg_type(type_: str | None) -> str | None:
    """Return a type without its array brackets."""
    return type_ if type_ is None else type_.partition("[")[0]


def resolve_type(type_: str, package_context: str) -> str:
    """Return a type with its package, by default ``package_context``."""
    base = type_.partition("[")[0]
    if base == HEADER:
        return "std_msgs/Header"
    return type_ if base in BUILTIN_TYPES or SEP in type_ else f"{package_context}{SEP}{type_}"


def parse_type(type_: str) -> tuple[str, bool, int | None]:
    """Return (base type, whether it is an array, its fixed length). Raise MsgSpecException if the type is invalid."""
    if not type_:
        raise MsgSpecException("Invalid empty type")
    base, bracket, rest = type_.partition("[")
    if not bracket:
        return type_, False, None
    if "[" in rest:
        raise MsgSpecException(f"Currently only support 1-dimensional array types: {type_}")
    if rest == "]":
        return base, True, None
    try:
        return base, True, int(rest[:-1])
    except ValueError:
        raise MsgSpecException(f"Invalid array dimension: [{rest[:-1]}]") from None


def is_header_type(type_: str) -> bool:
    """Return whether a type is one of the names for std_msgs/Header."""
    return genmsg.is_header_type(type_)


def is_valid_msg_field_name(x: str) -> bool:
    """Return whether a string is a legal field name."""
    return bool(genmsg.is_valid_msg_field_name(x))


def list_msg_types(package: str, include_depends: bool) -> list[str]:
    """Return the names of a package's messages, without the package; ``include_depends`` applies only to rosbuild."""
    return sorted(Catalogue({package: Packages().find(package)}).files(package, "msg"))


def msg_file(package: str, type_: str) -> str:
    """Return the path of a message's definition file, which need not exist.

    Raise InvalidROSPkgException if the package does not exist.
    """
    return resource_file(package, "msg", type_ + EXT)


def get_pkg_msg_specs(package: str) -> tuple[list[tuple[str, MsgSpec]], list[str]]:
    """Return (name, definition) for each of a package's messages, and the names of the unreadable ones."""
    _init()
    found: list[tuple[str, MsgSpec]] = []
    failed: list[str] = []
    for name in list_msg_types(package, False):
        try:
            found.append(load_from_file(msg_file(package, name), package))
        except (MsgSpecException, OSError, UnicodeDecodeError) as error:
            failed.append(name)
            print(f"ERROR: unable to load {name}, {error}")
    return found, failed


def load_by_type(msgtype: str, package_context: str = "") -> tuple[str, MsgSpec]:
    """Return (full name, definition) for a type. Raise MsgSpecException if its package does not exist."""
    package, slash, name = msgtype.partition(SEP)
    package, name = (package, name) if slash else (package_context, msgtype)
    try:
        path = msg_file(package, name)
    except InvalidROSPkgException:
        raise MsgSpecException(
            f"Cannot locate message type [{msgtype}], package [{package}] does not exist"
        ) from None
    return load_from_file(path, package)


def load_from_file(file_path: str, package_context: str = "") -> tuple[str, MsgSpec]:
    """Return (full name, definition) for a definition file. Raise MsgSpecException if it is invalid."""
    if VERBOSE:
        print(
            "Load spec from", file_path, *([f"into package [{package_context}]"] if package_context else [])
        )
    file_name = os.path.basename(file_path)
    short = file_name[: -len(EXT)]
    package = package_context.rstrip(SEP)
    full = f"{package}{SEP}{short}" if package_context else short
    if not is_valid_msg_type(full):
        raise MsgSpecException(f"{file_path}: [{full}] is not a legal type name")
    with open(file_path, encoding="utf-8") as stream:
        text = stream.read()
    try:
        return full, load_from_string(text, package, full, short)
    except MsgSpecException as error:
        raise MsgSpecException(f"{file_name}: {error}") from error


def load_from_string(
    text: str, package_context: str = "", full_name: str = "", short_name: str = ""
) -> MsgSpec:
    """Parse a definition from a string; types without a package belong to ``package_context``.

    Raise MsgSpecException if the string is invalid.
    """
    types: list[str] = []
    names: list[str] = []
    constants: list[Constant] = []
    for line in text.split("\n"):
        declared = line.partition(COMMENTCHAR)[0].strip()
        if not declared:
            continue
        type_, *words = declared.split()
        if not is_valid_msg_type(type_):
            raise MsgSpecException(f"{type_} is not a legal message type")
        if CONSTCHAR in declared:
            constants.append(_constant(type_, declared, line))
            continue
        if len(words) != 1:
            raise MsgSpecException(f"Invalid declaration: {declared}")
        if not is_valid_msg_field_name(words[0]):
            raise MsgSpecException(f"{words[0]} is not a legal message field name")
        is_local = package_context and SEP not in type_ and type_.partition("[")[0] not in RESERVED_TYPES
        types.append(f"{package_context}{SEP}{type_}" if is_local else type_)
        names.append(words[0])
    return MsgSpec(types, names, constants, text, full_name, short_name, package_context)


def _constant(type_: str, declared: str, line: str) -> Constant:
    if not is_valid_constant_type(type_):
        raise MsgSpecException(f"{type_} is not a legal constant type")
    # A string constant extends to the end of the line and may contain a #.
    name, _, value = (line if type_ == "string" else declared).strip().partition(" ")[2].partition(CONSTCHAR)
    if type_ != "string" and CONSTCHAR in value:
        raise MsgSpecException(f"Invalid declaration: {declared}")
    try:
        return Constant(type_, name, _convert_val(type_, value), value.strip())
    except (MsgSpecException, ValueError, SyntaxError) as error:
        raise MsgSpecException(f"Invalid declaration: {error}") from error


def _convert_val(type_: str, val: str) -> object:
    """Return a constant's value, converted from text. Raise MsgSpecException or ValueError if it does not match the type."""
    if type_ in ("float32", "float64"):
        return float(val)
    if type_ == "string":
        return val.strip()
    if type_ == "bool":
        return bool(ast.literal_eval(val.strip()))
    if type_ not in PRIMITIVE_TYPES:
        raise MsgSpecException(f"invalid constant type: [{type_}]")
    number = int(val)
    low, high = genmsg.RANGES[type_]
    if not low <= number <= high:
        raise MsgSpecException(f"cannot coerce [{number}] to {type_} (out of bounds)")
    return number


def _strify_spec(spec: MsgSpec, buff: TextIO | None = None, indent: str = "") -> str:
    """Format a definition, expanding fields whose message types are registered; also write it to ``buff``."""
    stream = StringIO() if buff is None else buff
    for constant in spec.constants:
        stream.write(f"{indent}{constant.type} {constant.name}={constant.val_text}\n")
    for type_, name in spec.fields():
        stream.write(f"{indent}{type_} {name}\n")
        base = type_.partition("[")[0]
        if base not in BUILTIN_TYPES:
            _strify_spec(get_registered(base), stream, indent + "  ")
    return stream.getvalue() if isinstance(stream, StringIO) else ""


EXTENDED_BUILTINS = {TIME: load_from_string(TIME_MSG), DURATION: load_from_string(DURATION_MSG)}
REGISTERED_TYPES: dict[str, MsgSpec] = {}
_loaded: list[str] = []
_initialized = [False]


def _init() -> None:
    """Register the types known in every package."""
    if _initialized[0]:
        return
    _initialized[0] = True
    _, header = load_from_file(msg_file("std_msgs", HEADER), "")
    for name in (HEADER, f"std_msgs/{HEADER}", f"roslib/{HEADER}"):
        register(name, header)
    for name, spec in EXTENDED_BUILTINS.items():
        register(name, spec)


def reinit() -> None:
    """Remove all registered definitions except the types known in every package."""
    _initialized[0] = False
    _loaded.clear()
    REGISTERED_TYPES.clear()
    _init()


def load_package(package: str) -> None:
    """Register a package's messages, with and without the package's name."""
    _init()
    if VERBOSE:
        print("Load package", package)
    if package in _loaded:
        if VERBOSE:
            print(f"Package {package} is already loaded")
        return
    _loaded.append(package)
    specs, _ = get_pkg_msg_specs(package)
    if VERBOSE:
        print(f"Package contains the following messages: {specs}")
    for name, spec in specs:
        register(name, spec)
        register(f"{package}{SEP}{name}", spec)


def load_package_dependencies(package: str, load_recursive: bool = False) -> None:
    """Register the messages of a package's direct dependencies or, if ``load_recursive``, of all its dependencies."""
    from minirospy.ros.rospkg.rospkg.rospack import RosPack

    _init()
    if VERBOSE:
        print("Load dependencies for package", package)
    for each in RosPack().get_depends(package, implicit=load_recursive):
        if VERBOSE:
            print("Load dependency", each)
        if each not in _loaded and each != package:
            _loaded.append(each)
            for name, spec in get_pkg_msg_specs(each)[0]:
                register(name, spec)


def is_registered(msg_type_name: str) -> bool:
    """Return whether a definition is registered under a name."""
    return msg_type_name in REGISTERED_TYPES


def get_registered(msg_type_name: str, default_package: str | None = None) -> MsgSpec:
    """Return the definition registered under a name or, failing that, under the name in ``default_package``.

    Raise KeyError if no definition is registered.
    """
    if msg_type_name not in REGISTERED_TYPES and default_package and SEP not in msg_type_name:
        return REGISTERED_TYPES[f"{default_package}{SEP}{msg_type_name}"]
    return REGISTERED_TYPES[msg_type_name]


def register(msg_type_name: str, msg_spec: MsgSpec) -> None:
    """Register a definition under a name."""
    if VERBOSE:
        sys.stdout.write(f"Register msg {msg_type_name}\n")
    REGISTERED_TYPES[msg_type_name] = msg_spec


def _msg_filter(f: str) -> bool:
    """Return whether a path is a message definition file."""
    return os.path.isfile(f) and f.endswith(EXT)
