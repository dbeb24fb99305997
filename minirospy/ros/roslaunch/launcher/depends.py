"""Finds launch files' dependencies (nodes, files, packages), and those missing from package.xml.

Source: http://wiki.ros.org/roslaunch/Commandline%20Tools#roslaunch-deps.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from minirospy.base.errors import LaunchError
from minirospy.ros.roslaunch.launcher.arg_docs import describe_args
from minirospy.ros.roslaunch.launcher.load import LaunchSource, Problems, load_sources
from minirospy.workspace.manifest import Kind, read_manifest
from minirospy.workspace.packages import Packages, package_name

__all__ = ["FileNeeds", "file_needs", "missing_declarations", "package_of"]


class FileNeeds(NamedTuple):
    """A launch file's dependencies: its nodes (package, program), the files it includes, and all packages it names."""

    nodes: tuple[tuple[str, str], ...]
    includes: tuple[str, ...]
    packages: tuple[str, ...]


def file_needs(
    files: Sequence[str], packages: Packages, warn: Callable[[LaunchError], None] = lambda _: None
) -> dict[str, FileNeeds]:
    """Return the dependencies of each launch file and each file it includes. Raise LaunchError if a file is invalid.

    An arg without a value or a missing parameter file is not an error, because it may be supplied later. ``warn``
    is called for each file that cannot be included.
    """
    sources = []
    for file in files:
        unset = {arg.name: "" for arg in describe_args(file) if arg.default is None}
        sources.append(LaunchSource(file, None, unset))
    problems: Problems = []
    spec = load_sources(sources, packages, problems=problems)
    for problem in problems:
        if problem.text.startswith("cannot include"):
            warn(problem)
    needs: dict[str, FileNeeds] = {}
    for file in dict.fromkeys([*files, *(inner for _, inner in spec.includes)]):
        nodes = tuple(
            dict.fromkeys((node.package, node.type) for node in spec.runnables() if node.file == file)
        )
        includes = tuple(dict.fromkeys(inner for outer, inner in spec.includes if outer == file))
        own = package_of(file)
        included = (package_of(inner) for inner in includes)
        called = [*(package for package, _ in nodes), *(each for each in included if each and each != own)]
        needs[file] = FileNeeds(nodes, includes, tuple(dict.fromkeys(filter(None, called))))
    return needs


def missing_declarations(needs: Mapping[str, FileNeeds], *, tests: bool = False) -> dict[str, list[str]]:
    """Return the packages that launch files need but package.xml does not declare.

    The result is a dict of sorted lists, keyed by the package whose package.xml is incomplete.

    If ``tests``, test dependencies also count as declared. Raise ManifestError if a package.xml is invalid.
    """
    found: dict[str, set[str]] = {}
    for file, what in needs.items():
        folder = _package_folder(file)
        if folder is None:
            continue
        manifest = read_manifest(folder / "package.xml")
        declared = {manifest.name, *manifest.depends(Kind.EXEC, *([Kind.TEST] if tests else []))}
        found.setdefault(manifest.name, set()).update(set(what.packages) - declared)
    return {package: sorted(missing) for package, missing in found.items() if missing}


def package_of(file: str) -> str | None:
    """Return the package that contains a file."""
    folder = _package_folder(file)
    return package_name(folder) if folder else None


def _package_folder(file: str) -> Path | None:
    return next((folder for folder in Path(file).resolve().parents if package_name(folder)), None)
