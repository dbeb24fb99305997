"""rospkg's classes and functions, over Packages and Dependencies; `import rospkg` re-exports them.

Source: http://docs.ros.org/independent/api/rospkg/html/python_api.html. Where rospkg asks rosdep's database which names
are packages, ours asks the packages that it finds: the other names are rosdep keys.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from minirospy.compat.rospkg.environment import get_ros_paths
from minirospy.errors import ManifestError, nearest
from minirospy.workspace.dependencies import Dependencies
from minirospy.workspace.packages import Packages, package_name

if TYPE_CHECKING:
    from minirospy.workspace import manifest

__all__ = [
    "MANIFEST_FILE",
    "PACKAGE_FILE",
    "ROS_STACK",
    "STACK_FILE",
    "Depend",
    "Export",
    "InvalidManifest",
    "Manifest",
    "ManifestManager",
    "ResourceNotFound",
    "RosDep",
    "RosPack",
    "RosStack",
    "expand_to_packages",
    "get_package_name",
    "get_stack_version_by_dir",
    "list_by_path",
    "parse_manifest_file",
]

MANIFEST_FILE = "manifest.xml"
PACKAGE_FILE = "package.xml"
STACK_FILE = "stack.xml"
ROS_STACK = "ros"

Names = list[str]
_Manager = TypeVar("_Manager", bound="ManifestManager")


class ResourceNotFound(Exception):
    """No package or stack of a name; ``ros_paths`` are the folders that were searched."""

    def __init__(self, msg: str, ros_paths: Sequence[str] | None = None, nearest: Sequence[str] = ()) -> None:
        super().__init__(msg)
        self.ros_paths = ros_paths
        self.nearest = nearest

    def __str__(self) -> str:
        hint = f" (did you mean {' or '.join(self.nearest)}?)" if self.nearest else ""
        paths = [f"ROS path [{index}]={path}" for index, path in enumerate(self.ros_paths or ())]
        return "\n".join([f"{self.args[0]}{hint}", *paths])


class InvalidManifest(Exception):
    """A package.xml does not read."""


class Depend(NamedTuple):
    """A dependency on a package."""

    name: str
    type: str = "package"

    def __str__(self) -> str:
        return self.name


class RosDep(NamedTuple):
    """A dependency on what is no ROS package."""

    name: str

    def __str__(self) -> str:
        return self.name


class Export:
    """A tag in the exports of a package."""

    def __init__(self, tag: str, attrs: Mapping[str, str], str: str) -> None:
        self.tag = tag
        self.attrs = attrs
        self.str = str

    def get(self, attr: str) -> str | None:
        """The value of an attribute, or None."""
        return self.attrs.get(attr)


class Manifest:
    """A package.xml as rospkg shows it. ``filename`` is its path."""

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
        """The values of an attribute in the exports of a tag; ``${prefix}`` becomes the folder if ``convert``."""
        values = [export.attrs[attr] for export in self.exports if export.tag == tag and attr in export.attrs]
        folder = os.path.dirname(self.filename)
        return [value.replace("${prefix}", folder) if convert else value for value in values]


class ManifestManager:
    """Packages, or stacks, below some folders. What is found is kept: a new object sees what is new on disk."""

    def __init__(self, ros_paths: Sequence[str] | None = None) -> None:
        self._ros_paths = get_ros_paths() if ros_paths is None else list(ros_paths)
        self._tree = Dependencies(Packages.below(*map(Path, self._ros_paths)), os.environ)
        self._custom: dict[Any, Any] = {}

    @classmethod
    def get_instance(cls: type[_Manager], ros_paths: Sequence[str] | None = None) -> _Manager:
        """The one object for these folders."""
        key: Any = cls
        found = _instance(key, tuple(get_ros_paths() if ros_paths is None else ros_paths))
        assert isinstance(found, cls)
        return found

    @property
    def ros_paths(self) -> Names:
        """The folders that are searched."""
        return list(self._ros_paths)

    def get_ros_paths(self) -> Names:
        """The folders that are searched."""
        return self.ros_paths

    def list(self) -> Names:
        """The names, sorted."""
        return list(self._folders())

    def get_path(self, name: str) -> str:
        """The folder of one. Raises ResourceNotFound."""
        folders = self._folders()
        if name not in folders:
            raise ResourceNotFound(name, self._ros_paths, nearest(name, folders))
        return str(folders[name])

    def get_manifest(self, name: str) -> Manifest:
        """The manifest of one. Raises ResourceNotFound, InvalidManifest."""
        return Manifest(self._read(name), *self._split(name))

    def get_depends(self, name: str, implicit: bool = True) -> Names:
        """The packages that one names, or with ``implicit`` also what those need.

        Raises ResourceNotFound, InvalidManifest.
        """
        if not implicit:
            return self._split(name)[0]
        found: dict[str, None] = {}
        self._visit(name, found)
        found.pop(name, None)
        return list(found)

    def get_depends_on(self, name: str, implicit: bool = True) -> Names:
        """The packages that name this one, or with ``implicit`` those that need it."""
        found = []
        for other in self._folders():
            try:
                if name in self.get_depends(other, implicit):
                    found.append(other)
            except InvalidManifest:
                # It is not what was asked for.
                continue
        return found

    def get_custom_cache(self, key: Any, default: Any = None) -> Any:
        """What the user kept here."""
        return self._custom.get(key, default)

    def set_custom_cache(self, key: Any, value: Any) -> None:
        """Keep something."""
        self._custom[key] = value

    def _folders(self) -> dict[str, Path]:
        raise NotImplementedError

    def _read(self, name: str) -> manifest.Manifest:
        self.get_path(name)
        try:
            return self._tree.manifest(name)
        except ManifestError as error:
            raise InvalidManifest(str(error)) from error

    def _split(self, name: str) -> tuple[Names, Names]:
        """The names in a manifest: those that are packages, those that are not."""
        from minirospy.workspace.manifest import Kind

        left_out = {Kind.DOC, Kind.BUILDTOOL_EXPORT}
        names = self._read(name).depends(*(kind for kind in Kind if kind not in left_out))
        known = self._tree.copies
        return [each for each in names if each in known], [each for each in names if each not in known]

    def _visit(self, name: str, found: dict[str, None]) -> None:
        for each in self._split(name)[0]:
            if each not in found:
                found[each] = None
                self._visit(each, found)
                # After what it needs.
                found[each] = found.pop(each)


class RosPack(ManifestManager):
    """Packages."""

    def get_rosdeps(self, package: str, implicit: bool = True) -> Names:
        """The names in a manifest, or with ``implicit`` also in those that it needs, that are no packages.

        Raises ResourceNotFound, InvalidManifest.
        """
        names = [package, *(self.get_depends(package) if implicit else [])]
        return list(dict.fromkeys(key for name in names for key in self._split(name)[1]))

    def stack_of(self, package: str) -> str | None:
        """The stack of a package: None, as catkin has no stacks. Raises ResourceNotFound."""
        self.get_path(package)
        return None

    def _folders(self) -> dict[str, Path]:
        return {name: folders[0] for name, folders in self._tree.copies.items()}


class RosStack(ManifestManager):
    """Metapackages."""

    def packages_of(self, stack: str) -> Names:
        """The packages that a metapackage names. Raises ResourceNotFound, InvalidManifest."""
        return self.get_depends(stack, implicit=False)

    def get_stack_version(self, stack: str) -> str:
        """The version of a metapackage. Raises ResourceNotFound, InvalidManifest."""
        return self._read(stack).version

    def _folders(self) -> dict[str, Path]:
        return self._tree.metapackages


@lru_cache(maxsize=64)
def _instance(cls: type[ManifestManager], ros_paths: tuple[str, ...]) -> ManifestManager:
    return cls(ros_paths)


def _people(read: manifest.Manifest) -> str:
    def shown(person: manifest.Person) -> str:
        return f"{person.name} <{person.email}>" if person.email else person.name

    maintainers = [shown(person) for person in read.maintainers]
    said = [f"Maintainer: {', '.join(maintainers)}"] if maintainers else []
    return ", ".join([*said, *map(shown, read.authors)])


# --- files


def parse_manifest_file(dirpath: str, manifest_name: str = PACKAGE_FILE, rospack: Any = None) -> Manifest:
    """The package.xml in a folder; every dependency counts as a package. Raises InvalidManifest."""
    from minirospy.workspace.manifest import read_manifest

    try:
        read = read_manifest(Path(dirpath), os.environ)
    except ManifestError as error:
        raise InvalidManifest(str(error)) from error
    return Manifest(read, read.depends(), ())


def list_by_path(manifest_name: str, path: str, cache: dict[str, str]) -> list[str]:
    """The packages below a folder; their folders go into ``cache``."""
    found = {name: str(folder) for name, folder in Packages.below(Path(path)).folders().items()}
    for name, folder in found.items():
        cache.setdefault(name, folder)
    return list(found)


def get_package_name(path: str) -> str | None:
    """The package that a path is or lies in; None where it is in none."""
    place = Path(path).absolute()
    return next(filter(None, map(package_name, (place, *place.parents))), None)


def expand_to_packages(
    names: Sequence[str], rospack: RosPack, rosstack: RosStack
) -> tuple[list[str], list[str]]:
    """(packages, unknown names): names of metapackages become those of their packages."""
    packages, unknown = [], []
    for name in dict.fromkeys(names):
        if name in rospack.list():
            packages.append(name)
        elif name in rosstack.list():
            packages += rosstack.packages_of(name)
        else:
            unknown.append(name)
    return list(dict.fromkeys(packages)), unknown


def get_stack_version_by_dir(stack_dir: str) -> str:
    """The version in the package.xml of a folder. Raises InvalidManifest."""
    return parse_manifest_file(stack_dir).version
