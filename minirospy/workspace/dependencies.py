"""Dependencies between packages, as rospack reports them.

A dependency is a name in ``run_depend``, ``exec_depend`` or ``depend`` that is a package; the other names in a manifest are
rosdep keys. Source: http://docs.ros.org/api/rospack/html/commandline.html.
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
    """Packages depend on each other. ``circle`` lists them, starting and ending with the same package."""

    def __init__(self, circle: tuple[str, ...]) -> None:
        super().__init__(circle)
        self.circle = circle

    def __str__(self) -> str:
        if len(self.circle) == 2:
            return f"package '{self.circle[0]}' depends on itself"
        return f"circular dependency: {' -> '.join(self.circle)}"


class Dependencies:
    """The dependencies between packages. Each manifest is read once, on first use.

    Metapackages are left out, as in rospack; ``with_metapackages`` includes them, as in rosstack. When all manifests are
    searched, ``complain`` is called with the error for each manifest that cannot be read.
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
        self._left_out = (lambda folder: False) if with_metapackages else is_metapackage
        self._manifests: dict[str, Manifest] = {}

    @property
    def roots(self) -> tuple[Path, ...]:
        """Return the folders that are searched for packages."""
        return self._packages.roots

    @cached_property
    def copies(self) -> dict[str, list[Path]]:
        """Return all packages, sorted, each with the folders that contain a package of that name.

        The first folder is the one used.
        """
        return {
            name: folders
            for name, folders in sorted(self._packages.copies().items())
            if not self._left_out(folders[0])
        }

    @cached_property
    def metapackages(self) -> dict[str, Path]:
        """Return a dict from metapackage to folder."""
        return {name: folder for name, folder in self._packages.folders().items() if is_metapackage(folder)}

    def folder(self, name: str) -> Path:
        """Return a package's folder. Raise NotFoundError, with similar names, if it does not exist."""
        folder = self._packages.find(name)
        if self._left_out(folder):
            raise NotFoundError("package", name, (), f"a metapackage of that name is in {folder}")
        return folder

    def manifest(self, name: str) -> Manifest:
        """Return the manifest of a package or metapackage.

        Raise NotFoundError if it does not exist, ManifestError if it is invalid.
        """
        if name not in self._manifests:
            # Imported here, because `rospack find` does not need it.
            from minirospy.workspace.manifest import read_manifest

            self._manifests[name] = read_manifest(self._packages.find(name), self._variables)
        return self._manifests[name]

    def direct(self, name: str) -> list[str]:
        """Return a package's direct dependencies, sorted by the kind of tag. Raise the same exceptions as :meth:`manifest`."""
        self.folder(name)
        dependencies = self.manifest(name).dependencies
        wanted = [each.name for tag in _RUNNING for each in dependencies if each.tag == tag]
        return [each for each in dict.fromkeys(wanted) if each == name or each in self.copies]

    def all(self, name: str) -> list[str]:
        """Return a package's direct and indirect dependencies in topological order: each follows its own dependencies.

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
        """Yield (dependency, depth), each dependency after the package that depends on it. Depths start at 0.

        A dependency of several packages is yielded several times. Raise the same exceptions as :meth:`all`.
        """
        return _walk(name, self.direct, ())

    def chains(self, name: str, target: str) -> list[tuple[str, ...]]:
        """Return every dependency path from the package ``name`` to ``target``. Raise the same exceptions as :meth:`all`."""
        found = []
        path: list[str] = [name]
        for depth, each in self.tree(name):
            path[depth + 1 :] = [each]
            if each == target:
                found.append(tuple(path))
        return found

    def dependents(self, name: str) -> list[str]:
        """Return the packages that directly depend on this one, sorted. Raise NotFoundError if it does not exist."""
        self.folder(name)
        return [other for other in self.copies if other != name and name in self._direct_or_none(other)]

    def all_dependents(self, name: str) -> list[str]:
        """Return the packages that directly or indirectly depend on this one, sorted.

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
        """Return all of a package's dependencies, of every kind, sorted. Raise the same exceptions as :meth:`manifest`."""
        self.folder(name)
        return sorted(self.manifest(name).depends())

    def _direct_or_none(self, name: str) -> list[str]:
        if name not in self._readable:
            return []
        return self.direct(name)

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
        # Do not parse a file that does not contain this tag at all.
        if b"<metapackage" not in (folder / "package.xml").read_bytes():
            return False
        from minirospy.workspace.manifest import read_manifest

        return read_manifest(folder).is_metapackage
    except (OSError, ManifestError):
        return False


def _walk(name: str, direct: Callable[[str], list[str]], above: tuple[str, ...]) -> Iterator[tuple[int, str]]:
    if name in above:
        raise CircularDependencyError((*above[above.index(name) :], name))
    for each in direct(name):
        yield len(above), each
        yield from _walk(each, direct, (*above, name))
