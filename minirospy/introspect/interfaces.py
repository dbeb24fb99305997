"""Message and service types as packages define them: names, definitions and md5sums.

Definitions are read from their files, so that a type is found before its package is built. Source:
http://wiki.ros.org/rosmsg.
"""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum

from minirospy.base.errors import NotFoundError
from minirospy.core.idl.digest import Lookup, message_md5, service_md5
from minirospy.core.idl.load import Catalogue
from minirospy.core.idl.spec import MessageSpec, ServiceSpec
from minirospy.workspace.packages import Packages

__all__ = ["Interfaces", "Kind", "describe"]

_INDENT = "  "


class Kind(Enum):
    """The kind of a definition; the value is its folder and its file extension."""

    MESSAGE = "msg"
    SERVICE = "srv"

    @property
    def word(self) -> str:
        """The word for this kind in messages to users."""
        return "message" if self is Kind.MESSAGE else "service"


class Interfaces:
    """All types of one kind in all packages. Methods raise DefinitionError if a definition cannot be parsed."""

    def __init__(self, packages: Packages, kind: Kind) -> None:
        self._packages = packages
        self._kind = kind
        self._catalogue = Catalogue(packages.folders())

    def packages(self) -> list[str]:
        """Return the sorted names of the packages that define types of this kind."""
        return [package for package in sorted(self._catalogue.packages) if self._names(package)]

    def in_package(self, package: str) -> list[str]:
        """Return the sorted types (``pkg/Name``) that a package defines. Raise NotFoundError if the package does not exist."""
        self._packages.find(package)
        return [f"{package}/{name}" for name in self._names(package)]

    def all(self) -> list[str]:
        """Return every type, sorted by package, then name."""
        return [
            f"{package}/{name}"
            for package in sorted(self._catalogue.packages)
            for name in self._names(package)
        ]

    def find(self, name: str) -> list[str]:
        """Return the types that match ``name``: ``pkg/Name`` matches one type, ``Name`` the types of this name in all packages.

        Raise NotFoundError with similar names if no type matches.
        """
        everything = self.all()
        by_itself = "/" not in name
        found = [type_ for type_ in everything if (type_.partition("/")[2] if by_itself else type_) == name]
        if not found:
            known = {type_.partition("/")[2] for type_ in everything} if by_itself else everything
            tool = "rosmsg" if self._kind is Kind.MESSAGE else "rossrv"
            if name in self._catalogue.packages:
                hint = f"it is a package: `{tool} package {name}` lists its types"
            elif self._is_of_other_kind(name):
                other, word = ("rossrv", "service") if self._kind is Kind.MESSAGE else ("rosmsg", "message")
                known, hint = [], f"it is a {word} type: `{other} show {name}`"
            else:
                hint = ""
            raise NotFoundError(f"{self._kind.word} type", name, known, hint)
        return found

    def text(self, type_: str) -> str:
        """Return the text of a type's definition file, unchanged. Raise NotFoundError if the type does not exist."""
        return self._spec(type_).text

    def description(self, type_: str) -> str:
        """Return a type's constants and fields, with nested types expanded. Raise NotFoundError if a type does not exist."""
        return describe(self._spec(type_), self._catalogue.message)

    def md5sum(self, type_: str) -> str:
        """Return a type's md5sum. Raise NotFoundError if the type, or one of its fields' types, does not exist."""
        spec = self._spec(type_)
        if isinstance(spec, ServiceSpec):
            return service_md5(spec, self._catalogue.message)
        return message_md5(spec, self._catalogue.message)

    def _is_of_other_kind(self, name: str) -> bool:
        """Return whether a type exists as the other kind: as a service instead of a message, or vice versa."""
        other = Interfaces(self._packages, Kind.SERVICE if self._kind is Kind.MESSAGE else Kind.MESSAGE)
        types = other.all()
        return name in types or any(type_.partition("/")[2] == name for type_ in types)

    def _spec(self, type_: str) -> MessageSpec | ServiceSpec:
        if self._kind is Kind.MESSAGE:
            return self._catalogue.message(type_)
        package = type_.partition("/")[0]
        if package in self._catalogue.packages:
            for service in self._catalogue.services(package):
                if service.full_name == type_:
                    return service
        raise NotFoundError("service type", type_, self.all())

    def _names(self, package: str) -> list[str]:
        """Return the sorted names of the types that a package's files define. An action file defines seven messages."""
        folder = self._catalogue.packages[package]
        ending = self._kind.value
        names = {path.stem for path in (folder / ending).glob(f"*.{ending}")}
        if self._kind is Kind.MESSAGE and any((folder / "action").glob("*.action")):
            names |= {message.name for message in self._catalogue.messages(package)}
        return sorted(names)


def describe(spec: MessageSpec | ServiceSpec, lookup: Lookup) -> str:
    """Format a type like `rosmsg show`: one line per constant and field, with nested types indented below."""
    if isinstance(spec, ServiceSpec):
        lines = [*_lines(spec.request, lookup, ""), "---", *_lines(spec.response, lookup, "")]
    else:
        lines = list(_lines(spec, lookup, ""))
    return "".join(f"{line}\n" for line in lines)


def _lines(spec: MessageSpec, lookup: Lookup, indent: str) -> Iterator[str]:
    for constant in spec.constants:
        yield f"{indent}{constant.type} {constant.name}={constant.value}"
    for field in spec.fields:
        yield f"{indent}{field.type} {field.name}"
        if not field.type.is_primitive:
            yield from _lines(lookup(field.type.base), lookup, indent + _INDENT)
