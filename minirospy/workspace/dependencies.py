"""Dependencies between packages, as rospack reports them.

A dependency is a name in ``run_depend``, ``exec_depend`` or ``depend`` that is a package; the other names in a manifest are
rosdep keys. In rosbuild's manifest.xml, ``depend`` always names a package, and ``rosdep`` a key.
Source: http://docs.ros.org/api/rospack/html/commandline.html.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from minirospy.base.errors import ManifestError, MinirospyError, NotFoundError
from minirospy.workspace.packages import Packages

if TYPE_CHECKING:
    from minirospy.workspace.manifest import Manifest

__all__ = ["CircularDependencyError", "Dependencies", "is_metapackage"]

_RUNNING = ("run_depend", "exec_depend", "depend")


class CircularDependencyError(MinirospyError):
    """Raised if packages depend on each other. ``circle`` lists the cycle; its first package is also its last."""

    def __init__(self, circle: tuple[str, ...]) -> None:
        super().__init__(circle)
        self.circle = circle

    def __str__(self) -> str:
        if len(self.circle) == 2:
            return f"package '{self.circle[0]}' depends on itself"
        return f"circular dependency: {' -> '.join(self.circle)}"


class Dependencies:
    """The dependencies between packages. Each manifest is read once, when it is first needed.

    Metapackages are left out, as in rospack; ``with_metapackages`` includes them and leaves out packages for rosbuild, as in
    rosstack. When all manifests are searched, ``complain`` is called with the error for each manifest that cannot be read.
    """

    def __init__(
        self,
        packages: Packages,
        variables: Mapping[str, str] | None = None,
        complain: Callable[[ManifestError], None] | None = None,
        with_metapackages: bool = False,
    ) -> None:
        self._packages = packages
        self._variables = variables
        self._complain = complain or (lambda error: None)
        self._left_out = _is_only_for_rosbuild if with_metapackages else is_metapackage
        self._manifests: dict[str, Manifest] = {}
        self._missing: dict[tuple[str, str], None] = {}

    @property
    def roots(self) -> tuple[Path, ...]:
        """Return the folders in which packages are searched."""
        return self._packages.roots

    @cached_property
    def copies(self) -> dict[str, list[Path]]:
        """Return all packages, sorted by name, each with all folders that contain a package of this name.

        The first folder is the one used.
        """
        return {
            name: folders
            for name, folders in sorted(self._packages.copies().items())
            if not self._left_out(folders[0])
        }

    @cached_property
    def metapackages(self) -> dict[str, Path]:
        """Return the folders of the metapackages, keyed by name."""
        return {name: folder for name, folder in self._packages.folders().items() if is_metapackage(folder)}

    def folder(self, name: str) -> Path:
        """Return a package's folder. If it does not exist, raise NotFoundError, which lists similar names."""
        folder = self._packages.find(name)
        if self._left_out(folder):
            raise NotFoundError("package", name, (), f"a metapackage of that name is in {folder}")
        return folder

    def manifest(self, name: str) -> Manifest:
        """Return the manifest of a package or metapackage.

        Raise NotFoundError if it does not exist, ManifestError if it is invalid.
        """
        if name not in self._manifests:
            # Import this here, because `rospack find` does not need it.
            from minirospy.workspace.manifest import read_manifest

            self._manifests[name] = read_manifest(self._packages.find(name), self._variables)
        return self._manifests[name]

    @property
    def missing(self) -> list[tuple[str, str]]:
        """Return (package, dependency) for each nonexistent dependency in the manifest.xml files that have been read."""
        return list(self._missing)

    def direct(self, name: str) -> list[str]:
        """Return a package's direct dependencies, ordered by the kind of tag. Raise the same exceptions as :meth:`manifest`."""
        wanted = self._wanted(name)
        if self.manifest(name).is_rosbuild:
            absent = (each for each in wanted if each != name and each not in self.copies)
            self._missing.update(((name, each), None) for each in absent)
        return self._known(name, wanted)

    def _wanted(self, name: str) -> list[str]:
        self.folder(name)
        dependencies = self.manifest(name).dependencies
        return list(dict.fromkeys(each.name for tag in _RUNNING for each in dependencies if each.tag == tag))

    def _known(self, name: str, wanted: list[str]) -> list[str]:
        return [each for each in wanted if each == name or each in self.copies]

    def all(self, name: str) -> list[str]:
        """Return a package's direct and indirect dependencies in topological order: each package follows its own dependencies.

        Raise CircularDependencyError if the dependencies form a cycle; otherwise raise the same exceptions as :meth:`direct`.
        """
        found: dict[str, None] = {}

        def visit(current: str, above: tuple[str, ...]) -> None:
            if current in above:
                raise CircularDependencyError((*above[above.index(current) :], current))
            for each in self.direct(current):
                if each not in found:
                    visit(each, (*above, current))
                    found[each] = None

        visit(name, ())
        return list(found)

    def tree(self, name: str) -> Iterator[tuple[int, str]]:
        """Yield (depth, dependency) for each dependency, after the package that depends on it. Depths start at 0.

        A dependency of several packages is yielded several times. Raise the same exceptions as :meth:`all`.
        """
        return _walk(name, self.direct, ())

    def chains(self, name: str, target: str) -> list[tuple[str, ...]]:
        """Return all dependency paths from the package ``name`` to ``target``. Raise the same exceptions as :meth:`all`."""
        found = []
        path: list[str] = [name]
        for depth, each in self.tree(name):
            path[depth + 1 :] = [each]
            if each == target:
                found.append(tuple(path))
        return found

    def dependents(self, name: str) -> list[str]:
        """Return the packages that depend directly on ``name``, sorted. Raise NotFoundError if that package does not exist."""
        self.folder(name)
        return [other for other in self.copies if other != name and name in self._direct_or_none(other)]

    def all_dependents(self, name: str) -> list[str]:
        """Return the packages that depend on ``name`` directly or indirectly, sorted.

        Raise NotFoundError if it does not exist.
        """
        found: dict[str, None] = {}
        waiting = [name]
        while waiting:
            for other in self.dependents(waiting.pop()):
                if other != name and other not in found:
                    found[other] = None
                    waiting.append(other)
        return sorted(found)

    def keys(self, name: str) -> list[str]:
        """Return the names of all dependencies of a package, of any kind, sorted; for rosbuild, only rosdep keys.

        Raise the same exceptions as :meth:`manifest`.
        """
        self.folder(name)
        manifest = self.manifest(name)
        if manifest.is_rosbuild:
            return sorted({each.name for each in manifest.dependencies if each.tag == "rosdep"})
        return sorted(manifest.depends())

    def _direct_or_none(self, name: str) -> list[str]:
        if name not in self._readable:
            return []
        return self._known(name, self._wanted(name))

    @cached_property
    def _readable(self) -> set[str]:
        found = set()
        for name in self.copies:
            try:
                self.manifest(name)
            except ManifestError as error:
                self._complain(error)
            else:
                found.add(name)
        return found


def is_metapackage(folder: Path) -> bool:
    """Return whether the package in a folder is a metapackage."""
    try:
        # Parse only a file that contains this tag.
        if b"<metapackage" not in (folder / "package.xml").read_bytes():
            return False
        from minirospy.workspace.manifest import read_manifest

        return read_manifest(folder).is_metapackage
    except (OSError, ManifestError):
        return False


def _is_only_for_rosbuild(folder: Path) -> bool:
    return not (folder / "package.xml").is_file()


def _walk(name: str, direct: Callable[[str], list[str]], above: tuple[str, ...]) -> Iterator[tuple[int, str]]:
    if name in above:
        raise CircularDependencyError((*above[above.index(name) :], name))
    for each in direct(name):
        yield len(above), each
        yield from _walk(each, direct, (*above, name))
