"""genmsg's classes and functions, based on minirospy's parser; `import genmsg` re-exports them for code generators.

Source: http://docs.ros.org/api/genmsg/html/.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from minirospy.base.errors import DefinitionError
from minirospy.core.idl import digest
from minirospy.core.idl.parse import parse_message, parse_service
from minirospy.core.idl.spec import MessageSpec, ServiceSpec
from minirospy.ros.genmsg.genmsg.base import (
    COMMENTCHAR,
    CONSTCHAR,
    EXT_MSG,
    EXT_SRV,
    IODELIM,
    SEP,
    InvalidMsgSpec,
)
from minirospy.ros.genmsg.genmsg.msgs import (
    DURATION,
    DURATION_MSG,
    HEADER,
    HEADER_FULL_NAME,
    TIME,
    TIME_MSG,
    Constant,
    MsgSpec,
    bare_msg_type,
    is_builtin,
    is_valid_msg_field_name,
    resolve_type,
    why_invalid,
)
from minirospy.ros.genmsg.genmsg.names import package_resource_name
from minirospy.ros.genmsg.genmsg.srvs import SrvSpec

__all__ = [
    "COMMENTCHAR",
    "CONSTCHAR",
    "DURATION",
    "DURATION_MSG",
    "EXT_MSG",
    "EXT_SRV",
    "HEADER",
    "HEADER_FULL_NAME",
    "IODELIM",
    "SEP",
    "TIME",
    "TIME_MSG",
    "MsgContext",
    "MsgNotFound",
    "get_msg_file",
    "get_srv_file",
    "is_valid_msg_field_name",
    "load_depends",
    "load_msg_by_type",
    "load_msg_from_file",
    "load_msg_from_string",
    "load_srv_by_type",
    "load_srv_from_file",
    "load_srv_from_string",
]

_BETWEEN = re.compile(r"^---.*\n?", re.MULTILINE)

SearchPath = Mapping[str, Sequence[str]]  # maps a package to the folders with its definitions


class MsgNotFound(Exception):
    """Raised if the file with a definition was not found."""

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


class MsgContext:
    """Stores the known messages, their files and the types that each message uses."""

    def __init__(self) -> None:
        self._specs: dict[str, MsgSpec] = {}
        self._files: dict[str, str] = {}
        self._depends: dict[str, list[str]] = {}

    @staticmethod
    def create_default() -> MsgContext:
        """Return a context that contains ``time`` and ``duration``."""
        context = MsgContext()
        for name, kind in (("time", "uint32"), ("duration", "int32")):
            text = f"{kind} secs\n{kind} nsecs"
            context.register(name, MsgSpec([kind, kind], ["secs", "nsecs"], [], text, name))
        return context

    def register(self, full_msg_type: str, msgspec: MsgSpec) -> None:
        """Add a message to the context."""
        self._specs[bare_msg_type(full_msg_type)] = msgspec

    def is_registered(self, full_msg_type: str) -> bool:
        """Return whether a message type, or an array's element type, is known."""
        return bare_msg_type(full_msg_type) in self._specs

    def get_registered(self, full_msg_type: str) -> MsgSpec:
        """Return a known message. Raise KeyError if the message is unknown."""
        return self._specs[bare_msg_type(full_msg_type)]

    def set_file(self, full_msg_type: str, file_path: str) -> None:
        """Record the file that contains a message's or service's definition."""
        self._files[full_msg_type] = file_path

    def get_file(self, full_msg_type: str) -> str | None:
        """Return the file that contains a message's or service's definition, or None if it is unknown."""
        return self._files.get(full_msg_type)

    def set_depends(self, full_msg_type: str, dependencies: list[str]) -> None:
        """Set the message types that a message's fields use."""
        self._depends[full_msg_type] = dependencies

    def get_depends(self, full_msg_type: str) -> list[str] | None:
        """Return the message types that a message's fields use, or None if :func:`load_depends` has not been called."""
        return self._depends.get(full_msg_type)

    def get_all_depends(self, full_msg_type: str) -> list[str]:
        """Return all message types that a message uses, directly or indirectly, in depth-first order.

        Raise KeyError if :func:`load_depends` has not been called.
        """
        found: list[str] = []
        for name in self._depends[full_msg_type]:
            found += [each for each in (name, *self.get_all_depends(name)) if each not in found]
        return found


def get_msg_file(package: str, base_type: str, search_path: SearchPath, ext: str = ".msg") -> str:
    """Return the file that contains a definition.

    Raise MsgNotFound if no file contains it, ValueError if the search path is not a dictionary.
    """
    if not isinstance(search_path, Mapping):
        raise ValueError("search_path must be a dictionary of namespaces to lists of folders")
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
    """Return the file that contains a service's definition. Raise MsgNotFound if no file contains it."""
    return get_msg_file(package, base_type, search_path, ".srv")


def load_msg_from_string(msg_context: MsgContext, text: str, full_name: str) -> MsgSpec:
    """Parse a message definition, add it to the context, and return it. Raise InvalidMsgSpec if the definition is invalid."""
    spec = _msg_spec(_parsed(text, full_name))
    msg_context.register(full_name, spec)
    return spec


def load_msg_from_file(msg_context: MsgContext, file_path: str, full_name: str) -> MsgSpec:
    """Load a message from a file, add it to the context, and return it.

    Raise InvalidMsgSpec if the definition is invalid, OSError if the file cannot be read.
    """
    text = _text(file_path)
    try:
        spec = load_msg_from_string(msg_context, text, full_name)
    except InvalidMsgSpec as error:
        raise InvalidMsgSpec(f"{file_path}: {error}") from error
    msg_context.set_file(full_name, file_path)
    return spec


def load_msg_by_type(msg_context: MsgContext, msg_type: str, search_path: SearchPath) -> MsgSpec:
    """Load a message by its type, add it to the context, and return it.

    Raise InvalidMsgSpec if the definition is invalid, MsgNotFound if it does not exist.
    """
    name = HEADER_FULL_NAME if msg_type == "Header" else msg_type
    package, base = package_resource_name(name)
    return load_msg_from_file(msg_context, get_msg_file(package, base, search_path), name)


def load_srv_from_string(msg_context: MsgContext, text: str, full_name: str) -> SrvSpec:
    """Parse a service definition and return it; add its request and response to the context.

    Raise InvalidMsgSpec if the definition is invalid.
    """
    parsed = parsed_service(text, full_name)
    request, response = _msg_spec(parsed.request), _msg_spec(parsed.response)
    for spec in (request, response):
        msg_context.register(spec.full_name, spec)
    return SrvSpec(request, response, text, full_name, parsed.name, parsed.package)


def load_srv_from_file(msg_context: MsgContext, file_path: str, full_name: str) -> SrvSpec:
    """Load a service from a file. Raise InvalidMsgSpec if the definition is invalid, OSError if the file cannot be read."""
    spec = load_srv_from_string(msg_context, _text(file_path), full_name)
    msg_context.set_file(full_name, file_path)
    return spec


def load_srv_by_type(msg_context: MsgContext, srv_type: str, search_path: SearchPath) -> SrvSpec:
    """Load a service by its type. Raise InvalidMsgSpec if the definition is invalid, MsgNotFound if it does not exist."""
    package, base = package_resource_name(srv_type)
    return load_srv_from_file(msg_context, get_srv_file(package, base, search_path), srv_type)


def load_depends(msg_context: MsgContext, spec: MsgSpec | SrvSpec, msg_search_path: SearchPath) -> list[str]:
    """Load all messages that a message or service uses. Return its fields' types, without duplicates.

    Raise InvalidMsgSpec if a definition is invalid, MsgNotFound if a definition is missing, ValueError if ``spec`` is not a
    message or service.
    """
    if not isinstance(spec, MsgSpec | SrvSpec):
        raise ValueError(f"spec does not appear to be a message or service: {spec}")
    if isinstance(spec, SrvSpec):
        both: list[str] = []
        for part in (spec.request, spec.response):
            load_depends(msg_context, part, msg_search_path)
            both += msg_context.get_depends(part.full_name) or ()
        both = list(dict.fromkeys(both))
        msg_context.set_depends(spec.full_name, both)
        return both

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
    return needed


def lookup_in(msg_context: MsgContext) -> digest.Lookup:
    """Return a lookup function for ``msg_context`` that returns a MessageSpec or raises KeyError."""
    return lambda name: parsed_message(msg_context.get_registered(name))


def parsed_message(spec: MsgSpec) -> MessageSpec:
    """Convert a genmsg message to minirospy's MessageSpec. Raise InvalidMsgSpec if the definition is invalid."""
    return _parsed(spec.text, spec.full_name)


def _parsed(text: str, full_name: str) -> MessageSpec:
    package, name = package_resource_name(full_name)
    try:
        return parse_message(text, package, name)
    except DefinitionError as error:
        raise InvalidMsgSpec(why_invalid(text) or str(error)) from error


def parsed_service(text: str, full_name: str) -> ServiceSpec:
    package, name = package_resource_name(full_name)
    request, *responses = _BETWEEN.split(text)
    if len(responses) != 1:
        # As in genmsg, accept a definition with no separator line, or several.
        text = "\n".join([request, "---", *responses])
    try:
        return parse_service(text, package, name)
    except DefinitionError as error:
        parts = (request, "\n".join(responses))
        raise InvalidMsgSpec(next(filter(None, map(why_invalid, parts)), str(error))) from error


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
