"""The folders in which the simulator searches for models, worlds and media, and the files that URIs refer to.

As in gazebo_ros, the folders come from GAZEBO_MODEL_PATH and GAZEBO_RESOURCE_PATH, then from packages that export them::

    <export><gazebo_ros gazebo_model_path="${prefix}/models" gazebo_media_path="${prefix}"/></export>

The library of models and worlds next to this module comes last. Nothing is downloaded. Source:
https://classic.gazebosim.org/tutorials?tut=components, gazebo_ros_paths_plugin.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote

from minirospy.base.errors import MinirospyError
from minirospy.base.xml_text import XmlError, parse_xml

__all__ = ["ResourcePaths", "exported_paths", "resource_paths"]

_HERE = Path(__file__).resolve().parent
_MANIFEST = "package.xml"
_MAX_MANIFEST_BYTES = 1024 * 1024

FindPackage = Callable[[str], "Path | str"]
"""Returns a package's folder. Raises a MinirospyError if the package does not exist."""


@dataclass(frozen=True)
class ResourcePaths:
    """The search folders for models, media and worlds, in order, and the function that finds packages."""

    models: tuple[str, ...]
    media: tuple[str, ...]
    find_package: FindPackage | None = None

    def resolve(self, uri: str) -> str | None:
        """Return the path of the existing file or folder for a URI or path, or None."""
        scheme, separator, rest = uri.strip().partition("://")
        if not separator:
            return self._existing(uri.strip())
        finders = {"model": self._model, "package": self._package, "file": self._existing}
        finder = finders.get(scheme)
        if finder is None or not rest:
            return None
        return finder(rest) or (finder(unquote(rest)) if "%" in rest else None)

    def find_world(self, name: str) -> str | None:
        """Return the path of a world file, such as ``worlds/empty.world``, or None if it does not exist."""
        path = self._existing(name) or _first((os.path.join(folder, "worlds") for folder in self.media), name)
        return path if path is not None and os.path.isfile(path) else None

    def _existing(self, path: str) -> str | None:
        path = os.path.expanduser(path)
        if os.path.isabs(path):
            return path if os.path.exists(path) else None
        if os.name == "nt" and path[:1] == "/" and os.path.exists(path[1:]):
            return path[1:]  # file:///C:/...
        return _first((os.curdir, *self.media, *self.models), path)

    def _model(self, name: str) -> str | None:
        # Models converted from URDF contain model:// in place of package://.
        return _first(self.models, name) or self._package(name)

    def _package(self, name: str) -> str | None:
        package, _, rest = name.strip("/").partition("/")
        if self.find_package is None or not package:
            return None
        try:
            path = os.path.join(self.find_package(package), rest)
        except MinirospyError:
            return None
        return path if os.path.exists(path) else None


def resource_paths(
    variables: Mapping[str, str],
    package_folders: Iterable[Path | str] = (),
    find_package: FindPackage | None = None,
    separator: str = os.pathsep,
) -> ResourcePaths:
    """Return the search paths from the environment variables and from the exports of the packages in ``package_folders``.

    ``~/.gazebo/models``, to which Gazebo downloads models, is searched if HOME is set.
    """
    folders = list(package_folders)
    models = [*_split(variables.get("GAZEBO_MODEL_PATH", ""), separator)]
    media = [*_split(variables.get("GAZEBO_RESOURCE_PATH", ""), separator)]
    models += exported_paths(folders, "gazebo_model_path", separator)
    media += exported_paths(folders, "gazebo_media_path", separator)
    home = variables.get("HOME") or variables.get("USERPROFILE")
    if home:
        models.append(os.path.join(home, ".gazebo", "models"))
    models.append(str(_HERE / "models"))
    media.append(str(_HERE))
    return ResourcePaths(tuple(dict.fromkeys(models)), tuple(dict.fromkeys(media)), find_package)


def exported_paths(folders: Iterable[Path | str], attribute: str, separator: str = os.pathsep) -> list[str]:
    """Return the folders that packages export in this attribute of ``<gazebo_ros>``. Skip packages that cannot be read."""
    found: list[str] = []
    for folder in folders:
        for element in _exports(Path(folder)):
            text = element.get(attribute, "").replace("${prefix}", str(folder))
            found += _split(text, separator)
    return found


def _exports(folder: Path) -> list[dict[str, str]]:
    """Return the attributes of the ``<gazebo_ros>`` elements in a package.xml."""
    path = folder / _MANIFEST
    try:
        if path.stat().st_size > _MAX_MANIFEST_BYTES:
            return []
        text = path.read_bytes()
        if b"<gazebo_ros" not in text:  # parsing hundreds of manifests would take a second, so check first
            return []
        root = parse_xml(text)
    except (OSError, XmlError):
        return []
    return [element.attributes for export in root.all("export") for element in export.all("gazebo_ros")]


def _split(text: str, separator: str) -> list[str]:
    return [os.path.normpath(part) for part in text.split(separator) if part.strip()]


def _first(folders: Iterable[str], name: str) -> str | None:
    """Return the path of the file or folder ``name`` in the first of ``folders`` that contains it, or None."""
    name = name.strip("/")
    paths = (os.path.normpath(os.path.join(folder, name)) for folder in folders)
    return next((path for path in paths if name and os.path.exists(path)), None)
