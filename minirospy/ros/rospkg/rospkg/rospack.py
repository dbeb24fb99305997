"""rospkg's classes and functions, implemented with Packages and Dependencies; `import rospkg` re-exports them.

Source: http://docs.ros.org/independent/api/rospkg/html/python_api.html. rospkg reads rosdep's database to distinguish
packages from rosdep keys. This module instead treats any name that is not a known package as a rosdep key.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Hashable, Iterator, Sequence
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from minirospy.base.errors import ManifestError
from minirospy.base.suggestions import nearest
from minirospy.ros.rospkg.rospkg.environment import get_ros_paths
from minirospy.workspace.dependencies import Dependencies
from minirospy.workspace.packages import Packages, package_name

if TYPE_CHECKING:
    from minirospy.workspace import manifest
from minirospy.ros.rospkg.rospkg.common import MANIFEST_FILE, PACKAGE_FILE, STACK_FILE, ResourceNotFound
from minirospy.ros.rospkg.rospkg.manifest import (
    InvalidManifest,
    Manifest,
    catkin_manifest,
    parse_manifest_file,
)

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
    """Finds packages or stacks below the given folders. Results are cached: create a new object to see changes on disk."""

    _manifest_name = MANIFEST_FILE

    def __init__(self, ros_paths: Sequence[str] | None = None) -> None:
        self._ros_paths = get_ros_paths() if ros_paths is None else list(ros_paths)
        self._tree = Dependencies(Packages.below(*map(Path, self._ros_paths)), os.environ)
        self._custom: dict[Hashable, object] = {}
        self._manifests: dict[str, Manifest | None] = {}

    @classmethod
    def get_instance(cls: type[_Manager], ros_paths: Sequence[str] | None = None) -> _Manager:
        """Return the shared instance for these folders."""
        key: object = cls
        found = _instance(key, tuple(get_ros_paths() if ros_paths is None else ros_paths))
        assert isinstance(found, cls)
        return found

    @property
    def ros_paths(self) -> Names:
        """Return the folders searched."""
        return list(self._ros_paths)

    def get_ros_paths(self) -> Names:
        """Return ``ros_paths``, the folders searched for packages or stacks."""
        return self.ros_paths

    def list(self) -> Names:
        """Return the names of all packages or stacks, sorted."""
        return list(self._folders())

    def get_path(self, name: str) -> str:
        """Return the folder of a package or stack. Raise ResourceNotFound if it does not exist."""
        folders = self._folders()
        if name not in folders:
            raise ResourceNotFound(name, self._ros_paths, nearest(name, folders))
        return str(folders[name])

    def get_manifest(self, name: str) -> Manifest:
        """Return the manifest of a package or stack.

        Raise ResourceNotFound if it does not exist, InvalidManifest if its manifest cannot be parsed.
        """
        return self._rosbuild(name) or catkin_manifest(self._read(name), *self._split(name))

    def get_depends(self, name: str, implicit: bool = True) -> Names:
        """Return a package's direct dependencies, or all of them if ``implicit``.

        Raise ResourceNotFound if a package does not exist, InvalidManifest if a manifest cannot be parsed.
        """
        if not implicit:
            return self._split(name)[0]
        found: dict[str, None] = {}
        self._visit(name, found)
        found.pop(name, None)
        return list(found)

    def get_depends_on(self, name: str, implicit: bool = True) -> Names:
        """Return the packages that depend on this one directly, or also indirectly if ``implicit``."""
        found = []
        for other in self._folders():
            try:
                if name in self.get_depends(other, implicit):
                    found.append(other)
            except (InvalidManifest, ResourceNotFound):
                # An invalid manifest or a missing package does not affect other packages.
                continue
        return found

    def get_custom_cache(self, key: Hashable, default: object = None) -> Any:
        """Return a value from the program's own cache."""
        return self._custom.get(key, default)

    def set_custom_cache(self, key: Hashable, value: object) -> None:
        """Store a value in the program's own cache."""
        self._custom[key] = value

    def _load_manifest(self, name: str) -> Manifest:
        # Programs call this method although it is private in rospkg too.
        return self.get_manifest(name)

    def _folders(self) -> dict[str, Path]:
        raise NotImplementedError

    def _read(self, name: str) -> manifest.Manifest:
        self.get_path(name)
        try:
            return self._tree.manifest(name)
        except ManifestError as error:
            raise InvalidManifest(str(error)) from error

    def _rosbuild(self, name: str) -> Manifest | None:
        """Return a package's manifest.xml or a stack's stack.xml, or None if there is none."""
        if name not in self._manifests:
            folder = self.get_path(name)
            exists = os.path.isfile(os.path.join(folder, self._manifest_name))
            self._manifests[name] = parse_manifest_file(folder, self._manifest_name) if exists else None
        return self._manifests[name]

    def _split(self, name: str) -> tuple[Names, Names]:
        """Return a manifest's dependencies as (packages, others)."""
        from minirospy.workspace.manifest import Kind

        if rosbuild := self._rosbuild(name):
            return [each.name for each in rosbuild.depends], [each.name for each in rosbuild.rosdeps]
        left_out = {Kind.DOC, Kind.BUILDTOOL_EXPORT}
        names = self._read(name).depends(*(kind for kind in Kind if kind not in left_out))
        known = self._tree.copies
        return [each for each in names if each in known], [each for each in names if each not in known]

    def _visit(self, name: str, found: dict[str, None]) -> None:
        for each in self._split(name)[0]:
            if each not in found:
                found[each] = None
                self._visit(each, found)
                # Move the package after its dependencies.
                found[each] = found.pop(each)


class RosPack(ManifestManager):
    """Finds packages."""

    def get_rosdeps(self, package: str, implicit: bool = True) -> Names:
        """Return a package's dependencies that are not packages; if ``implicit``, also those of its dependencies.

        If one of these cannot be read, return only the package's own. Raise ResourceNotFound if the package does not exist,
        InvalidManifest if its manifest cannot be parsed.
        """
        self._split(package)
        names = [package]
        if implicit:
            with contextlib.suppress(InvalidManifest, ResourceNotFound):
                names += self.get_depends(package)
        return list(dict.fromkeys(key for name in names for key in self._split(name)[1]))

    def stack_of(self, package: str) -> str | None:
        """Return the rosbuild stack whose folder contains a package, or None; catkin has no stacks.

        Raise ResourceNotFound if the package does not exist.
        """
        folder = Path(self.get_path(package))
        return next((each.name for each in (folder, *folder.parents) if (each / STACK_FILE).is_file()), None)

    def _folders(self) -> dict[str, Path]:
        return {name: folders[0] for name, folders in self._tree.copies.items()}


class RosStack(ManifestManager):
    """Finds metapackages and rosbuild stacks."""

    _manifest_name = STACK_FILE

    def packages_of(self, stack: str) -> Names:
        """Return a metapackage's packages, or the packages in a stack's folder.

        Raise ResourceNotFound if it does not exist, InvalidManifest if its manifest cannot be parsed.
        """
        folder = self._folders().get(stack)
        if folder and (folder / STACK_FILE).is_file():
            return sorted(Packages.below(folder).copies())
        return self.get_depends(stack, implicit=False)

    def get_stack_version(self, stack: str) -> str | None:
        """Return a metapackage's version, or None for a rosbuild stack.

        Raise ResourceNotFound if it does not exist, InvalidManifest if its manifest cannot be parsed.
        """
        return get_stack_version_by_dir(self.get_path(stack))

    def _folders(self) -> dict[str, Path]:
        return self._known_stacks

    @cached_property
    def _known_stacks(self) -> dict[str, Path]:
        stacks = {
            folder.name: folder
            for root in self._ros_paths
            for folder in _folders_with(STACK_FILE, Path(root))
        }
        return {**stacks, **self._tree.metapackages}


@lru_cache(maxsize=64)
def _instance(cls: type[ManifestManager], ros_paths: tuple[str, ...]) -> ManifestManager:
    return cls(ros_paths)


def list_by_path(manifest_name: str, path: str, cache: dict[str, str]) -> list[str]:
    """Return the packages below a folder, or its stacks if ``manifest_name`` is stack.xml; store their folders in ``cache``.

    If it is package.xml, rosbuild packages are left out.
    """
    if manifest_name == STACK_FILE:
        found = {folder.name: str(folder) for folder in _folders_with(STACK_FILE, Path(path))}
    else:
        folders = Packages.below(Path(path)).folders()
        found = {
            name: str(folder)
            for name, folder in folders.items()
            if manifest_name != PACKAGE_FILE or (folder / PACKAGE_FILE).is_file()
        }
    for name, folder in found.items():
        cache.setdefault(name, folder)
    return list(found)


def _folders_with(name: str, root: Path) -> Iterator[Path]:
    """Yield the folders at or below ``root`` that contain a file.

    Skip hidden folders, and folders inside such a folder or a package.
    """
    for folder, below, files in os.walk(root):
        if name in files:
            yield Path(folder)
        if {name, MANIFEST_FILE, PACKAGE_FILE, "CATKIN_IGNORE", "rospack_nosubdirs"} & set(files):
            below.clear()
        below[:] = sorted(each for each in below if not each.startswith("."))


def get_package_name(path: str) -> str | None:
    """Return the package that contains a path, or None."""
    place = Path(path).absolute()
    for folder in (place, *place.parents):
        if name := folder.name if (folder / MANIFEST_FILE).is_file() else package_name(folder):
            return name
    return None


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


def get_stack_version_by_dir(stack_dir: str) -> str | None:
    """Return the version in a folder's package.xml, or None for a rosbuild stack.

    Raise InvalidManifest if it cannot be parsed.
    """
    if os.path.isfile(os.path.join(stack_dir, STACK_FILE)):
        return None
    return parse_manifest_file(stack_dir).version
