"""rospkg.manifest: a parsed package.xml, with rospkg's attributes."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from minirospy.base.errors import ManifestError

if TYPE_CHECKING:
    from minirospy.workspace import manifest
from minirospy.ros.rospkg.rospkg.common import PACKAGE_FILE

__all__ = ["Depend", "Export", "InvalidManifest", "Manifest", "RosDep", "parse_manifest_file"]


class InvalidManifest(Exception):
    """Raised if a package.xml is invalid."""


class Depend(NamedTuple):
    """A dependency on a package."""

    name: str
    type: str = "package"

    def __str__(self) -> str:
        return self.name


class RosDep(NamedTuple):
    """A dependency on something other than a ROS package."""

    name: str

    def __str__(self) -> str:
        return self.name


class Export:
    """A tag in a package's exports."""

    def __init__(self, tag: str, attrs: Mapping[str, str], str: str) -> None:
        self.tag = tag
        self.attrs = attrs
        self.str = str

    def get(self, attr: str) -> str | None:
        """Return an attribute's value, or None if the tag does not have the attribute."""
        return self.attrs.get(attr)


class Manifest:
    """A parsed package.xml, with rospkg's attributes. ``filename`` is its path."""

    is_catkin = True
    brief = license_url = status = notes = ""

    def __init__(self, read: manifest.Manifest, depends: Sequence[str], rosdeps: Sequence[str]) -> None:
        self.type = "package"
        self.filename = str(read.path)
        self.name = read.name
        self.version = read.version
        self.description = read.description
        self.author = _people(read)
        self.licenses = list(read.licenses)
        self.license = ", ".join(read.licenses)
        self.url = next((each.url for each in read.urls if each.type == "website"), "")
        self.depends = [Depend(name) for name in depends]
        self.rosdeps = [RosDep(name) for name in rosdeps]
        self.exports = [Export(each.tag, each.attributes, each.text) for each in read.exports]
        self.platforms: list[str] = []
        self.unknown_tags: list[str] = []

    def get_export(self, tag: str, attr: str, convert: bool = True) -> list[str]:
        """Return the values of an attribute in all exports with this tag.

        If ``convert``, replace ``${prefix}`` with the folder.
        """
        values = [export.attrs[attr] for export in self.exports if export.tag == tag and attr in export.attrs]
        folder = os.path.dirname(self.filename)
        return [value.replace("${prefix}", folder) if convert else value for value in values]


def _people(read: manifest.Manifest) -> str:
    def shown(person: manifest.Person) -> str:
        return f"{person.name} <{person.email}>" if person.email else person.name

    maintainers = [shown(person) for person in read.maintainers]
    said = [f"Maintainer: {', '.join(maintainers)}"] if maintainers else []
    return ", ".join([*said, *map(shown, read.authors)])


def parse_manifest_file(dirpath: str, manifest_name: str = PACKAGE_FILE, rospack: object = None) -> Manifest:
    """Return a folder's parsed package.xml. Every dependency in it counts as a package.

    Raise InvalidManifest if the package.xml cannot be parsed.
    """
    from minirospy.workspace.manifest import read_manifest

    try:
        read = read_manifest(Path(dirpath), os.environ)
    except ManifestError as error:
        raise InvalidManifest(str(error)) from error
    return Manifest(read, read.depends(), ())
