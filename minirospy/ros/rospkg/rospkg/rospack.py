"""rospkg's classes and functions, implemented with Packages and Dependencies; `import rospkg` re-exports them.

Source: http://docs.ros.org/independent/api/rospkg/html/python_api.html. rospkg reads rosdep's database to distinguish
packages from rosdep keys. This module instead treats any name that is not a known package as a rosdep key.
"""

from __future__ import annotations

import os
from collections.abc import Hashable, Sequence
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from minirospy.base.errors import ManifestError
from minirospy.base.suggestions import nearest
from minirospy.ros.rospkg.rospkg.environment import get_ros_paths
from minirospy.workspace.dependencies import Dependencies
from minirospy.workspace.packages import Packages, package_name

if TYPE_CHECKING:
    from minirospy.workspace import manifest
from minirospy.ros.rospkg.rospkg.common import ResourceNotFound
from minirospy.ros.rospkg.rospkg.manifest import InvalidManifest, Manifest, parse_manifest_file

__all__ = [
    "ManifestManager",
    "RosPack",
    "RosStack",
    "expand_to_packages",
    "get_package_name",
    "get_stack_version_by_dir",
    "list_by_path",
]

Names = list[str]
_Manager = TypeVar("_Manager", bound="ManifestManager")


class ManifestManager:
    """Finds packages or stacks below the given folders. Results are cached, so create a new object to see changes on disk."""

    def __init__(self, ros_paths: Sequence[str] | None = None) -> None:
        self._ros_paths = get_ros_paths() if ros_paths is None else list(ros_paths)
        self._tree = Dependencies(Packages.below(*map(Path, self._ros_paths)), os.environ)
        self._custom: dict[Hashable, object] = {}

    @classmethod
    def get_instance(cls: type[_Manager], ros_paths: Sequence[str] | None = None) -> _Manager:
        """Return the shared object for these folders."""
        key: object = cls
        found = _instance(key, tuple(get_ros_paths() if ros_paths is None else ros_paths))
        assert isinstance(found, cls)
        return found

    @property
    def ros_paths(self) -> Names:
        """Return the searched folders."""
        return list(self._ros_paths)

    def get_ros_paths(self) -> Names:
        """Return the searched folders."""
        return self.ros_paths

    def list(self) -> Names:
        """Return the names of all packages or stacks, sorted."""
        return list(self._folders())

    def get_path(self, name: str) -> str:
        """Return the folder of a package or stack. Raise ResourceNotFound if there is no such package or stack."""
        folders = self._folders()
        if name not in folders:
            raise ResourceNotFound(name, self._ros_paths, nearest(name, folders))
        return str(folders[name])

    def get_manifest(self, name: str) -> Manifest:
        """Return the manifest of a package or stack.

        Raise ResourceNotFound if it does not exist, InvalidManifest if its manifest cannot be parsed.
        """
        return Manifest(self._read(name), *self._split(name))

    def get_depends(self, name: str, implicit: bool = True) -> Names:
        """Return a package's direct dependencies or, if ``implicit``, all of them.

        Raise ResourceNotFound if a package does not exist, InvalidManifest if a manifest cannot be parsed.
        """
        if not implicit:
            return self._split(name)[0]
        found: dict[str, None] = {}
        self._visit(name, found)
        found.pop(name, None)
        return list(found)

    def get_depends_on(self, name: str, implicit: bool = True) -> Names:
        """Return the packages that depend on this one directly or, if ``implicit``, directly or indirectly."""
        found = []
        for other in self._folders():
            try:
                if name in self.get_depends(other, implicit):
                    found.append(other)
            except InvalidManifest:
                # Ignore an invalid manifest, which must not affect other packages.
                continue
        return found

    def get_custom_cache(self, key: Hashable, default: object = None) -> Any:
        """Return a value from the program's own cache."""
        return self._custom.get(key, default)

    def set_custom_cache(self, key: Hashable, value: object) -> None:
        """Store a value in the program's own cache."""
        self._custom[key] = value

    def _load_manifest(self, name: str) -> Manifest:
        # Programs call this method although it is private in rospkg, too.
        return self.get_manifest(name)

    def _folders(self) -> dict[str, Path]:
        raise NotImplementedError

    def _read(self, name: str) -> manifest.Manifest:
        self.get_path(name)
        try:
            return self._tree.manifest(name)
        except ManifestError as error:
            raise InvalidManifest(str(error)) from error

    def _split(self, name: str) -> tuple[Names, Names]:
        """Return a manifest's dependencies as (packages, others)."""
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
                # Move the package behind its dependencies.
                found[each] = found.pop(each)


class RosPack(ManifestManager):
    """Finds packages."""

    def get_rosdeps(self, package: str, implicit: bool = True) -> Names:
        """Return a package's dependencies that are not packages; if ``implicit``, also those of the packages it depends on.

        Raise ResourceNotFound if a package does not exist, InvalidManifest if a manifest cannot be parsed.
        """
        names = [package, *(self.get_depends(package) if implicit else [])]
        return list(dict.fromkeys(key for name in names for key in self._split(name)[1]))

    def stack_of(self, package: str) -> str | None:
        """Return None, because catkin has no stacks. Raise ResourceNotFound if the package does not exist."""
        self.get_path(package)
        return None

    def _folders(self) -> dict[str, Path]:
        return {name: folders[0] for name, folders in self._tree.copies.items()}


class RosStack(ManifestManager):
    """Finds metapackages."""

    def packages_of(self, stack: str) -> Names:
        """Return a metapackage's packages.

        Raise ResourceNotFound if it does not exist, InvalidManifest if its manifest cannot be parsed.
        """
        return self.get_depends(stack, implicit=False)

    def get_stack_version(self, stack: str) -> str:
        """Return a metapackage's version.

        Raise ResourceNotFound if it does not exist, InvalidManifest if its manifest cannot be parsed.
        """
        return self._read(stack).version

    def _folders(self) -> dict[str, Path]:
        return self._tree.metapackages


@lru_cache(maxsize=64)
def _instance(cls: type[ManifestManager], ros_paths: tuple[str, ...]) -> ManifestManager:
    return cls(ros_paths)


def list_by_path(manifest_name: str, path: str, cache: dict[str, str]) -> list[str]:
    """Return the packages below a folder; store their folders in ``cache``."""
    found = {name: str(folder) for name, folder in Packages.below(Path(path)).folders().items()}
    for name, folder in found.items():
        cache.setdefault(name, folder)
    return list(found)


def get_package_name(path: str) -> str | None:
    """Return the package that contains a path, or None if no package contains it."""
    place = Path(path).absolute()
    return next(filter(None, map(package_name, (place, *place.parents))), None)


def expand_to_packages(
    names: Sequence[str], rospack: RosPack, rosstack: RosStack
) -> tuple[list[str], list[str]]:
    """Replace metapackages with their packages; return (packages, unknown names)."""
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
    """Return the version in a folder's package.xml. Raise InvalidManifest if the file cannot be parsed."""
    return parse_manifest_file(stack_dir).version
