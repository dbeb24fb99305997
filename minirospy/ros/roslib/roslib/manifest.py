"""roslib.manifest: reads the manifest.xml of packages for rosbuild, the build system before catkin.

For a package.xml, use rospkg.RosPack().get_manifest(). Source: http://wiki.ros.org/Manifest.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, NamedTuple
from xml.parsers.expat import ExpatError

from minirospy.base.xml_text import XmlError, check_xml
from minirospy.ros.roslib.roslib.exceptions import ROSLibException
from minirospy.ros.roslib.roslib.packages import InvalidROSPkgException, get_pkg_dir
from minirospy.ros.rospkg.rospkg.common import MANIFEST_FILE
from minirospy.ros.rospkg.rospkg.manifest import Export, child_elements, element_text
from minirospy.ros.rospkg.rospkg.manifest import RosDep as ROSDep

if TYPE_CHECKING:
    from xml.dom.minidom import Element

__all__ = [
    "MANIFEST_FILE",
    "Depend",
    "Export",
    "Manifest",
    "ManifestException",
    "ROSDep",
    "VersionControl",
    "load_manifest",
    "manifest_file",
    "parse",
    "parse_file",
]


class ManifestException(ROSLibException):
    """Raised if a manifest.xml is invalid."""


class Depend(NamedTuple):
    """A dependency on a package."""

    package: str

    def __repr__(self) -> str:
        return self.package


class VersionControl(NamedTuple):
    """The location of the package's source repository."""

    type: str
    url: str


class Manifest:
    """A manifest.xml's content, initially empty."""

    def __init__(self) -> None:
        self.description = self.brief = self.license = self.author = self.url = self.status = self.notes = ""
        self.depends: list[Depend] = []
        self.rosdeps: list[ROSDep] = []
        self.exports: list[Export] = []
        self.version: str | None = None
        self.versioncontrol: VersionControl | None = None

    def get_export(self, tag: str, attr: str) -> list[str | None]:
        """Return the values of an attribute in all exports with this tag."""
        return [export.get(attr) for export in self.exports if export.tag == tag and attr in export.attrs]


def folders_with(file: str, path: str) -> Iterator[str]:
    """Yield the folders below ``path`` that contain the manifest ``file``, without searching inside them."""
    for folder, subfolders, files in os.walk(path, followlinks=True):
        if file in files:
            yield folder
        if file in files or MANIFEST_FILE in files or "rospack_nosubdirs" in files:
            subfolders.clear()
        subfolders[:] = sorted(
            each
            for each in subfolders
            if each[0] != "." and not folder.startswith(os.path.realpath(os.path.join(folder, each)))
        )


def manifest_file(package: str, required: bool = True, env: Mapping[str, str] | None = None) -> str:
    """Return the path of a package's manifest.xml, which need not exist unless ``required``.

    Raise InvalidROSPkgException if the package, or a required file, does not exist.
    """
    for path in (os.environ if env is None else env).get("ROS_PACKAGE_PATH", "").split(os.pathsep):
        for folder in folders_with(MANIFEST_FILE, path) if path else ():
            if os.path.basename(folder) == package:
                return os.path.join(folder, MANIFEST_FILE)
    folder = str(get_pkg_dir(package))
    if required:
        text = f"\nPackage '{folder}' is improperly configured: no manifest file is present.\n"
        raise InvalidROSPkgException(text)
    return os.path.join(folder, MANIFEST_FILE)


def load_manifest(package: str) -> Manifest:
    """Return a package's manifest.

    Raise InvalidROSPkgException if the package does not exist, ManifestException if the manifest is invalid.
    """
    return parse_file(manifest_file(package))


def parse_file(file: str) -> Manifest:
    """Parse a manifest file. Raise ValueError if it does not exist, ManifestException if it is invalid."""
    if not file:
        raise ValueError("Missing manifest file argument")
    if not os.path.isfile(file):
        raise ValueError(f"Invalid/non-existent manifest file: {file}")
    with open(file, encoding="utf-8") as opened:
        return parse(opened.read(), file)


def parse(string: str, filename: str = "string") -> Manifest:
    """Parse a manifest from a string. Raise ManifestException if it is invalid."""
    from xml.dom.minidom import parseString

    try:
        check_xml(string)
        document = parseString(string)
    except (ExpatError, XmlError) as error:
        raise ManifestException(f"invalid XML: {error}") from error
    root = document.documentElement
    if root is None or root.tagName != "package":
        raise ManifestException("manifest must have a single 'package' element")
    return _manifest(root)


def _manifest(root: Element) -> Manifest:
    manifest = Manifest()
    for tag in ("description", "license", "author", "url"):
        found = child_elements(root, tag)
        if len(found) > 1 and tag != "author":
            have = "have only one" if tag == "license" else "have a single"
            raise ManifestException(f"Invalid manifest file: must {have} '{tag}' element")
        texts = (
            "".join(node.toxml() for node in each.childNodes) if tag == "description" else element_text(each)
            for each in found
        )
        setattr(manifest, tag, ", ".join(texts))
    for each in child_elements(root, "description"):
        manifest.brief = each.getAttribute("brief")
    for each in child_elements(root, "review"):
        manifest.status, manifest.notes = each.getAttribute("status"), each.getAttribute("notes")
    if child_elements(root, "version"):
        raise ManifestException("<version> tag is not valid in a package manifest.xml file")

    for each in child_elements(root, "depend"):
        if not each.hasAttribute("thirdparty"):
            if not each.hasAttribute("package"):
                raise ManifestException("Invalid manifest file: depends is missing 'package' attribute")
            manifest.depends.append(Depend(each.getAttribute("package")))
    manifest.rosdeps = [ROSDep(each.getAttribute("name")) for each in child_elements(root, "rosdep")]
    for each in child_elements(root, "versioncontrol")[:1]:
        manifest.versioncontrol = VersionControl(each.getAttribute("type"), each.getAttribute("url"))
    manifest.exports = [
        Export(each.tagName, dict(each.attributes.items()), element_text(each))
        for tag in child_elements(root, "export")
        for each in child_elements(tag)
    ]
    return manifest
