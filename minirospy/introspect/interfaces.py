"""Message and service types that are installed: which packages define them, their texts and md5sums.

Source: http://wiki.ros.org/rosmsg.
"""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING

from minirospy.errors import NotFoundError
from minirospy.workspace.packages import Packages

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["Interfaces", "Kind"]


class Kind(Enum):
    """What an interface file defines; the value is its folder and the ending of its name."""

    MESSAGE = "msg"
    SERVICE = "srv"

    @property
    def word(self) -> str:
        """The kind in words."""
        return "message" if self is Kind.MESSAGE else "service"


class Interfaces:
    """The interface files of one kind in all packages."""

    def __init__(self, packages: Packages, kind: Kind) -> None:
        self._packages = packages
        self._kind = kind

    def packages(self) -> list[str]:
        """The sorted names of the packages that define any."""
        return [name for name in sorted(self._packages.names()) if any(self._files(name))]

    def in_package(self, package: str) -> list[str]:
        """The sorted types (``pkg/Name``) that a package defines. Raises NotFoundError."""
        self._packages.find(package)
        return sorted(f"{package}/{file.stem}" for file in self._files(package))

    def all(self) -> list[str]:
        """Every type, sorted."""
        return [type_ for package in sorted(self._packages.names()) for type_ in self._types(package)]

    def find(self, name: str) -> list[str]:
        """The types that ``name`` stands for: itself where it has a package, else those of that bare name.

        Raises NotFoundError with the nearest names where there is none.
        """
        everything = self.all()
        if "/" in name:
            found = [name] if name in everything else []
        else:
            found = [type_ for type_ in everything if type_.rpartition("/")[2] == name]
        if not found:
            known = everything if "/" in name else [type_.rpartition("/")[2] for type_ in everything]
            raise NotFoundError(f"{self._kind.word} type", name, known)
        return found

    def text(self, type_: str) -> str:
        """The definition of a type as it stands in its file."""
        package, _, name = type_.partition("/")
        for file in self._files(package):
            if file.stem == name:
                return file.read_text(encoding="utf-8", errors="replace")
        raise NotFoundError(f"{self._kind.word} type", type_, self.all())

    def description(self, type_: str) -> str:
        """The fields and constants of a type, inner messages unfolded and indented, without comments."""
        from minirospy.idl import show

        return show.message_text(type_) if self._kind is Kind.MESSAGE else show.service_text(type_)

    def md5sum(self, type_: str) -> str:
        """The md5sum of a type."""
        from minirospy.idl.load import message_class, service_class

        find = message_class if self._kind is Kind.MESSAGE else service_class
        return str(find(type_)._md5sum)

    def _types(self, package: str) -> list[str]:
        return sorted(f"{package}/{file.stem}" for file in self._files(package))

    def _files(self, package: str) -> Iterator[Path]:
        return (self._packages.find(package) / self._kind.value).glob(f"*.{self._kind.value}")
