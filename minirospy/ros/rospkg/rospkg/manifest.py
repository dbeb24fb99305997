"""rospkg.manifest: a parsed package.xml, or rosbuild's manifest.xml or stack.xml, with rospkg's attributes."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from minirospy.base.errors import ManifestError
from minirospy.ros.rospkg.rospkg.common import MANIFEST_FILE, PACKAGE_FILE, STACK_FILE

if TYPE_CHECKING:
    from xml.dom.minidom import Element

    from minirospy.workspace import manifest

__all__ = [
    "Depend",
    "Export",
    "InvalidManifest",
    "Manifest",
    "Platform",
    "RosDep",
    "parse_manifest",
    "parse_manifest_file",
]

_ROOTS = {MANIFEST_FILE: "package", STACK_FILE: "stack"}
_TAGS = {
    *("author", "brief", "catkin", "depend", "description", "export", "license", "logo", "notes", "platform"),
    *("review", "rosbuild2", "rosdep", "status", "url", "version", "versioncontrol"),
}


class InvalidManifest(Exception):
    """Raised if a package.xml, manifest.xml or stack.xml is invalid."""


class Depend(NamedTuple):
    """A dependency on a package."""

    name: str
    type: str = "package"

    def __str__(self) -> str:
        return self.name

    def __repr__(self) -> str:
        return str(self)


class RosDep(NamedTuple):
    """A dependency on something other than a ROS package."""

    name: str

    def __str__(self) -> str:
        return self.name


class Platform(NamedTuple):
    """An operating system that a manifest.xml names."""

    os: str
    version: str
    notes: str | None = None

    def __str__(self) -> str:
        return f"{self.os} {self.version}"

    def __repr__(self) -> str:
        return str(self)


class Export:
    """A tag in a package's exports."""

    def __init__(self, tag: str, attrs: Mapping[str, str], str: str) -> None:
        self.tag = tag
        self.attrs = attrs
        self.str = str

    def get(self, attr: str) -> str | None:
        """Return an attribute's value, or None if the tag does not have it."""
        return self.attrs.get(attr)


class Manifest:
    """A parsed manifest with rospkg's attributes, initially empty. ``filename`` is its path."""

    def __init__(self, type_: str = "package", filename: str | None = None, is_catkin: bool = False) -> None:
        self.type = type_
        self.filename = filename
        self.is_catkin = is_catkin
        self.name = ""
        self.brief = self.license_url = self.status = self.notes = ""
        self.description: str | None = ""
        self.author: str | None = ""
        self.license: str | None = ""
        self.url: str | None = ""
        self.version: str | None = ""
        self.licenses: list[str] = []
        self.depends: list[Depend] = []
        self.rosdeps: list[RosDep] = []
        self.exports: list[Export] = []
        self.platforms: list[Platform] = []
        self.unknown_tags: list[Element] = []

    def get_export(self, tag: str, attr: str, convert: bool = True) -> list[str]:
        """Return an attribute's values in all exports with this tag. If ``convert``, replace ``${prefix}`` with its folder.

        Raise ValueError if ``convert`` and the manifest has no path.
        """
        values = [export.attrs[attr] for export in self.exports if export.tag == tag and attr in export.attrs]
        if not convert:
            return values
        if not self.filename:
            raise ValueError("cannot convert export values when filename for Manifest is not set")
        folder = os.path.dirname(self.filename)
        return [value.replace("${prefix}", folder) for value in values]


def catkin_manifest(read: manifest.Manifest, depends: Sequence[str], rosdeps: Sequence[str]) -> Manifest:
    """Return the manifest in a package.xml with rospkg's attributes; its dependencies are split into packages and others."""
    result = Manifest(filename=str(read.path), is_catkin=True)
    result.name = read.name
    result.version = read.version
    result.description = read.description
    result.author = _people(read)
    result.licenses = list(read.licenses)
    result.license = ", ".join(read.licenses)
    result.url = next((each.url for each in read.urls if each.type == "website"), "")
    result.depends = [Depend(name) for name in depends]
    result.rosdeps = [RosDep(name) for name in rosdeps]
    result.exports = [Export(each.tag, each.attributes, each.text) for each in read.exports]
    return result


def _people(read: manifest.Manifest) -> str:
    def shown(person: manifest.Person) -> str:
        return f"{person.name} <{person.email}>" if person.email else person.name

    maintainers = [shown(person) for person in read.maintainers]
    said = [f"Maintainer: {', '.join(maintainers)}"] if maintainers else []
    return ", ".join([*said, *map(shown, read.authors)])


def parse_manifest_file(dirpath: str, manifest_name: str = PACKAGE_FILE, rospack: object = None) -> Manifest:
    """Return a folder's parsed manifest: the given manifest.xml or stack.xml if it exists, otherwise package.xml.

    Every dependency in a package.xml counts as a package. Raise OSError if there is no manifest, InvalidManifest if it
    cannot be parsed.
    """
    from minirospy.workspace.manifest import read_manifest

    path = os.path.join(dirpath, manifest_name)
    if manifest_name in _ROOTS and os.path.isfile(path):
        with open(path, encoding="utf-8") as file:
            return parse_manifest(manifest_name, file.read(), path)
    if not os.path.isfile(os.path.join(dirpath, PACKAGE_FILE)):
        raise OSError(f"Invalid/non-existent manifest file: {path}")
    try:
        read = read_manifest(Path(dirpath), os.environ)
    except ManifestError as error:
        raise InvalidManifest(str(error)) from error
    return catkin_manifest(read, read.depends(), ())


def parse_manifest(manifest_name: str, string: str, filename: str = "string") -> Manifest:
    """Parse rosbuild's manifest.xml or stack.xml. Raise InvalidManifest if it is invalid.

    Source: http://wiki.ros.org/Manifest, http://wiki.ros.org/Stack%20Manifest.
    """
    root = _root(_ROOTS[manifest_name], string, filename)
    result = Manifest(root.tagName, filename)
    result.description = _only(root, "description", filename, raw=True)
    result.url = _only(root, "url", filename)
    result.version = _only(root, "version", filename)
    result.license = _license(root)
    result.author = ", ".join(map(element_text, child_elements(root, "author"))) or None
    result.brief = _attribute(root, "description", "brief")
    result.license_url = _attribute(root, "license", "url")
    result.status = _attribute(root, "review", "status", "unreviewed")
    result.notes = _attribute(root, "review", "notes")

    depends = (each for each in child_elements(root, "depend") if not each.hasAttribute("thirdparty"))
    result.depends = [
        Depend(
            _required(
                each,
                root.tagName,
                f"Invalid manifest file [{filename}]: depends is missing '{root.tagName}' attribute",
            ),
            root.tagName,
        )
        for each in depends
    ]
    result.rosdeps = [
        RosDep(_required(each, "name", f"invalid rosdep tag in [{filename}]"))
        for each in child_elements(root, "rosdep")
    ]
    result.platforms = [_platform(each) for each in child_elements(root, "platform")]
    result.exports = [
        Export(each.tagName, dict(each.attributes.items()), element_text(each, strip=False))
        for tag in child_elements(root, "export")
        for each in child_elements(tag)
    ]
    if root.tagName == "stack":
        for name in ("exports", "rosdeps"):
            if getattr(result, name):
                raise InvalidManifest(f"stack manifests are not allowed to have {name}")
    result.is_catkin = bool(child_elements(root, "catkin") or child_elements(root, "name"))
    result.unknown_tags = [each for each in child_elements(root) if each.tagName not in _TAGS]
    return result


def _root(tag: str, string: str, filename: str) -> Element:
    from xml.dom.minidom import parseString
    from xml.parsers.expat import ExpatError

    from minirospy.base.xml_text import XmlError, check_xml

    try:
        check_xml(string)
        root = parseString(string).documentElement
    except (ExpatError, XmlError) as error:
        raise InvalidManifest(f"[{filename}] invalid XML: {error}") from error
    if root is None or root.tagName != tag:
        raise InvalidManifest(f"manifest [{filename}] must have a single '{tag}' element")
    return root


def _only(root: Element, tag: str, filename: str, *, raw: bool = False) -> str | None:
    """Return the text of a tag that may occur only once, or None. If ``raw``, include the tags inside it."""
    found = child_elements(root, tag)
    if len(found) > 1:
        raise InvalidManifest(f"Invalid manifest file [{filename}]: must have a single '{tag}' element")
    if not found:
        return None
    return "".join(node.toxml() for node in found[0].childNodes) if raw else element_text(found[0])


def _license(root: Element) -> str:
    found = child_elements(root, "license")
    if len(found) > 1:
        raise InvalidManifest("Invalid manifest file: must have only one 'license' element")
    return element_text(found[0]) if found else ""


def _platform(element: Element) -> Platform:
    system, version = (
        _required(element, name, f"<platform> tag is missing required ''{name}'' attribute")
        for name in ("os", "version")
    )
    return Platform(system, version, element.getAttribute("notes"))


def _required(element: Element, attribute: str, missing: str) -> str:
    """Return an attribute. Raise InvalidManifest with the text ``missing`` if it is absent, ValueError if it is empty."""
    if not element.hasAttribute(attribute):
        raise InvalidManifest(missing)
    value = element.getAttribute(attribute)
    if not value:
        raise ValueError(f"bad '{attribute}' attribute")
    return value


def _attribute(root: Element, tag: str, attribute: str, default: str = "") -> str:
    found = child_elements(root, tag)
    return found[0].getAttribute(attribute) if found else default


def child_elements(parent: Element, tag: str = "") -> list[Element]:
    """Return the child elements with this tag, or all of them."""
    return [
        each for each in parent.childNodes if each.nodeType == each.ELEMENT_NODE and tag in ("", each.tagName)
    ]


def element_text(element: Element, *, strip: bool = True) -> str:
    """Return the text directly inside an element."""
    text = "".join(each.data for each in element.childNodes if each.nodeType == each.TEXT_NODE)
    return text.strip() if strip else text
