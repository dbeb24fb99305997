"""genmsg's classes and functions, over our parser; `import genmsg` re-exports them for programs that generate code.

Source: http://docs.ros.org/api/genmsg/html/.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from minirospy.compat.genpy.message import MsgGenerationException
from minirospy.errors import DefinitionError
from minirospy.idl import digest
from minirospy.idl.parse import parse_message, parse_service
from minirospy.idl.spec import MessageSpec, ServiceSpec

__all__ = [
    "BUILTIN_TYPES", "HEADER_FULL_NAME", "PRIMITIVE_TYPES", "Constant", "Field", "InvalidMsgSpec", "MsgContext",
    "MsgGenerationException", "MsgNotFound", "MsgSpec", "SrvSpec", "bare_msg_type", "compute_full_text",
    "compute_md5", "compute_md5_text", "get_msg_file", "get_srv_file", "is_builtin", "is_header_type",
    "is_valid_constant_type", "is_valid_msg_field_name", "is_valid_msg_type", "load_depends", "load_msg_by_type",
    "load_msg_from_file", "load_msg_from_string", "load_srv_by_type", "load_srv_from_file", "load_srv_from_string",
    "lookup_in", "parse_type", "parsed_message", "resolve_type",
]  # fmt: skip

HEADER_FULL_NAME = "std_msgs/Header"
PRIMITIVE_TYPES = [
    "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float32", "float64", "string", "bool",
    "char", "byte",
]  # fmt: skip
BUILTIN_TYPES = [*PRIMITIVE_TYPES, "time", "duration"]
_HEADERS = ("Header", HEADER_FULL_NAME, "roslib/Header")

SearchPath = Mapping[str, Sequence[str]]
"""Package -> folders of its definitions."""


class InvalidMsgSpec(Exception):
    """A definition does not parse."""


class MsgNotFound(Exception):
    """There is no file of a definition."""

    def __init__(
        self,
        message: str,
        base_type: str | None = None,
        package: str | None = None,
        search_path: SearchPath | None = None,
    ) -> None:
        super().__init__(message)
        self.base_type = base_type
        self.package = package
        self.search_path = search_path


class Constant(NamedTuple):
    """A constant: ``val`` is its value, ``val_text`` what the definition says."""

    type: str
    name: str
    val: Any
    val_text: str

    def __repr__(self) -> str:
        return f"{self.type} {self.name}={self.val}"


class Field:
    """A field, its type taken apart."""

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
    """A message: ``types`` and ``names`` of its fields, its constants, its text and name."""

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
        """(type, name) of each field."""
        return list(zip(self.types, self.names, strict=True))

    def parsed_fields(self) -> list[Field]:
        """The fields, their types taken apart."""
        return [Field(name, type_) for type_, name in self.fields()]

    def has_header(self) -> bool:
        """Whether it starts with a header that publishers fill in."""
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


class SrvSpec:
    """A service: the messages of its request and response."""

    def __init__(
        self,
        request: MsgSpec,
        response: MsgSpec,
        text: str,
        full_name: str = "",
        short_name: str = "",
        package: str = "",
    ) -> None:
        self.request = request
        self.response = response
        self.text = text
        self.full_name = full_name
        self.short_name = short_name
        self.package = package

    def __eq__(self, other: object) -> bool:
        return isinstance(other, SrvSpec) and vars(self) == vars(other)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"SrvSpec[{self.request!r}, {self.response!r}]"


class MsgContext:
    """The messages that are known, their files, and what each needs."""

    def __init__(self) -> None:
        self._specs: dict[str, MsgSpec] = {}
        self._files: dict[str, str] = {}
        self._depends: dict[str, list[str]] = {}

    @staticmethod
    def create_default() -> MsgContext:
        """A context that knows ``time`` and ``duration``."""
        context = MsgContext()
        for name, kind in (("time", "uint32"), ("duration", "int32")):
            text = f"{kind} secs\n{kind} nsecs"
            context.register(name, MsgSpec([kind, kind], ["secs", "nsecs"], [], text, name))
        return context

    def register(self, full_msg_type: str, msgspec: MsgSpec) -> None:
        """Make a message known."""
        self._specs[bare_msg_type(full_msg_type)] = msgspec

    def is_registered(self, full_msg_type: str) -> bool:
        """Whether a message, or that of an array, is known."""
        return bare_msg_type(full_msg_type) in self._specs

    def get_registered(self, full_msg_type: str) -> MsgSpec:
        """A message that is known. Raises KeyError."""
        return self._specs[bare_msg_type(full_msg_type)]

    def set_file(self, full_msg_type: str, file_path: str) -> None:
        """Say what file a definition stands in."""
        self._files[full_msg_type] = file_path

    def get_file(self, full_msg_type: str) -> str | None:
        """The file that a definition stands in; None where that is not known."""
        return self._files.get(full_msg_type)

    def set_depends(self, full_msg_type: str, dependencies: list[str]) -> None:
        """Say which messages one has in its fields."""
        self._depends[full_msg_type] = list(dependencies)

    def get_depends(self, full_msg_type: str) -> list[str] | None:
        """The messages that one has in its fields; None before :func:`load_depends`."""
        return self._depends.get(full_msg_type)

    def get_all_depends(self, full_msg_type: str) -> list[str]:
        """The messages that one needs, each before those that it needs itself. Raises KeyError."""
        found: list[str] = []
        for name in self._depends[full_msg_type]:
            found += [each for each in (name, *self.get_all_depends(name)) if each not in found]
        return found


def is_builtin(msg_type_name: str) -> bool:
    """Whether a type is no message."""
    return msg_type_name in BUILTIN_TYPES


def is_header_type(msg_type: str) -> bool:
    """Whether a type is that of a header, by any of its names."""
    return msg_type in _HEADERS


def is_valid_msg_type(x: str) -> bool:
    """Whether a text is a type's name, with or without brackets."""
    return bool(x) and re.match(r"[A-Za-z][\w/]*(\[\d*\])*\Z", x, re.ASCII) is not None


def is_valid_msg_field_name(x: str) -> bool:
    """Whether a text is a field's name."""
    return re.match(r"[A-Za-z]\w*\Z", x, re.ASCII) is not None


def is_valid_constant_type(x: str) -> bool:
    """Whether a constant can be of a type."""
    return x in PRIMITIVE_TYPES


def bare_msg_type(msg_type: str) -> str:
    """A type without its brackets."""
    return msg_type and msg_type.partition("[")[0]


def resolve_type(msg_type: str, package_context: str) -> str:
    """A type with its package, as definitions in ``package_context`` mean it."""
    bare = bare_msg_type(msg_type)
    if "/" in bare or is_builtin(bare):
        return msg_type
    # ROS's own forgets the brackets behind a Header.
    return f"std_msgs/{msg_type}" if bare == "Header" else f"{package_context}/{msg_type}"


def parse_type(msg_type: str) -> tuple[str, bool, int | None]:
    """(type without brackets, whether it is an array, its length where that is fixed). Raises ValueError."""
    if not msg_type:
        raise ValueError("Invalid empty type")
    base, bracket, rest = msg_type.partition("[")
    if not bracket:
        return base, False, None
    if "[" in rest:
        raise ValueError(f"Currently only support 1-dimensional array types: {msg_type}")
    length = rest.removesuffix("]")
    if not rest.endswith("]") or (length and not length.isdecimal()):
        raise ValueError(f"Invalid array dimension: [{length}]")
    return base, True, int(length) if length else None


def get_msg_file(package: str, base_type: str, search_path: SearchPath, ext: str = ".msg") -> str:
    """The file of a definition. Raises MsgNotFound."""
    if package not in search_path:
        raise MsgNotFound(
            f"Cannot locate message [{base_type}]: unknown package [{package}] on search path [{search_path}]",
            base_type,
            package,
            search_path,
        )
    folders = search_path[package]
    for folder in folders:
        path = Path(folder, base_type + ext)
        if path.is_file():
            return str(path)
    raise MsgNotFound(
        f"Cannot locate message [{base_type}] in package [{package}] with paths [{folders}]",
        base_type,
        package,
        search_path,
    )


def get_srv_file(package: str, base_type: str, search_path: SearchPath) -> str:
    """The file of a service's definition. Raises MsgNotFound."""
    return get_msg_file(package, base_type, search_path, ".srv")


def load_msg_from_string(msg_context: MsgContext, text: str, full_name: str) -> MsgSpec:
    """The message of a text, which becomes known. Raises InvalidMsgSpec."""
    spec = _msg_spec(_parsed(text, full_name))
    msg_context.register(full_name, spec)
    return spec


def load_msg_from_file(msg_context: MsgContext, file_path: str, full_name: str) -> MsgSpec:
    """The message of a file, which becomes known. Raises InvalidMsgSpec, OSError."""
    spec = load_msg_from_string(msg_context, _text(file_path), full_name)
    msg_context.set_file(full_name, file_path)
    return spec


def load_msg_by_type(msg_context: MsgContext, msg_type: str, search_path: SearchPath) -> MsgSpec:
    """A message by its name, which becomes known. Raises InvalidMsgSpec, MsgNotFound."""
    name = HEADER_FULL_NAME if msg_type == "Header" else msg_type
    package, _, base = name.rpartition("/")
    return load_msg_from_file(msg_context, get_msg_file(package, base, search_path), name)


def load_srv_from_string(msg_context: MsgContext, text: str, full_name: str) -> SrvSpec:
    """The service of a text; its request and response become known. Raises InvalidMsgSpec."""
    parsed = _parsed_service(text, full_name)
    request, response = _msg_spec(parsed.request), _msg_spec(parsed.response)
    for spec in (request, response):
        msg_context.register(spec.full_name, spec)
    return SrvSpec(request, response, text, full_name, parsed.name, parsed.package)


def load_srv_from_file(msg_context: MsgContext, file_path: str, full_name: str) -> SrvSpec:
    """The service of a file. Raises InvalidMsgSpec, OSError."""
    spec = load_srv_from_string(msg_context, _text(file_path), full_name)
    msg_context.set_file(full_name, file_path)
    return spec


def load_srv_by_type(msg_context: MsgContext, srv_type: str, search_path: SearchPath) -> SrvSpec:
    """A service by its name. Raises InvalidMsgSpec, MsgNotFound."""
    package, _, base = srv_type.rpartition("/")
    return load_srv_from_file(msg_context, get_srv_file(package, base, search_path), srv_type)


def load_depends(msg_context: MsgContext, spec: MsgSpec | SrvSpec, msg_search_path: SearchPath) -> None:
    """Make all that a message or service needs known. Raises InvalidMsgSpec, MsgNotFound."""
    if isinstance(spec, SrvSpec):
        both: list[str] = []
        for part in (spec.request, spec.response):
            load_depends(msg_context, part, msg_search_path)
            both += msg_context.get_depends(part.full_name) or ()
        msg_context.set_depends(spec.full_name, list(dict.fromkeys(both)))
        return
    bare = (resolve_type(bare_msg_type(type_), spec.package) for type_ in spec.types)
    needed = list(dict.fromkeys(name for name in bare if not is_builtin(name)))
    msg_context.set_depends(spec.full_name, needed)
    for name in needed:
        known = msg_context.is_registered(name)
        found = (
            msg_context.get_registered(name)
            if known
            else load_msg_by_type(msg_context, name, msg_search_path)
        )
        load_depends(msg_context, found, msg_search_path)


def compute_md5_text(msg_context: MsgContext, spec: MsgSpec) -> str:
    """What the md5sum of a message counts. Raises KeyError where it needs what is not known."""
    return digest.md5_text(parsed_message(spec), lookup_in(msg_context))


def compute_md5(msg_context: MsgContext, spec: MsgSpec | SrvSpec) -> str:
    """The md5sum of a message or service. Raises KeyError where it needs what is not known."""
    if isinstance(spec, SrvSpec):
        return digest.service_md5(_parsed_service(spec.text, spec.full_name), lookup_in(msg_context))
    return digest.message_md5(parsed_message(spec), lookup_in(msg_context))


def compute_full_text(msg_context: MsgContext, spec: MsgSpec | SrvSpec) -> str:
    """The text of a message or service and of all that it needs, as connection headers and bags hold it.

    Raises KeyError before :func:`load_depends`.
    """
    needed = msg_context.get_all_depends(spec.full_name)
    return digest.joined_texts(spec.text, ((name, msg_context.get_registered(name).text) for name in needed))


def lookup_in(msg_context: MsgContext) -> digest.Lookup:
    """Our specs of the messages that a context knows, by name. The function raises KeyError."""
    return lambda name: parsed_message(msg_context.get_registered(name))


def parsed_message(spec: MsgSpec) -> MessageSpec:
    """Our spec of a message. Raises InvalidMsgSpec."""
    return _parsed(spec.text, spec.full_name)


def _parsed(text: str, full_name: str) -> MessageSpec:
    package, _, name = full_name.rpartition("/")
    try:
        return parse_message(text, package, name)
    except DefinitionError as error:
        raise InvalidMsgSpec(str(error)) from error


def _parsed_service(text: str, full_name: str) -> ServiceSpec:
    package, _, name = full_name.rpartition("/")
    try:
        return parse_service(text, package, name)
    except DefinitionError as error:
        raise InvalidMsgSpec(str(error)) from error


def _msg_spec(parsed: MessageSpec) -> MsgSpec:
    constants = [Constant(c.type, c.name, c.value, c.text) for c in parsed.constants]
    types = [str(field.type) for field in parsed.fields]
    names = [field.name for field in parsed.fields]
    return MsgSpec(types, names, constants, parsed.text, parsed.full_name)


def _text(path: str) -> str:
    try:
        return Path(path).read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise InvalidMsgSpec(f"{path}: it is not UTF-8 text: {error}") from error
