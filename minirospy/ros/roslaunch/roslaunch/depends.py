"""roslaunch.depends: the dependencies of launch files."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence

from minirospy.base.errors import MinirospyError
from minirospy.ros.roslaunch.commands.roslaunch_deps import main as roslaunch_deps_main
from minirospy.ros.roslaunch.launcher.depends import FileNeeds, file_needs, missing_declarations, package_of
from minirospy.ros.roslaunch.roslaunch.substitution_args import chosen_packages

__all__ = [
    "NAME",
    "RoslaunchDeps",
    "RoslaunchDepsException",
    "calculate_missing",
    "fullusage",
    "parse_launch",
    "print_deps",
    "rl_file_deps",
    "roslaunch_deps",
    "roslaunch_deps_main",
]

NAME = "roslaunch-deps"


class RoslaunchDepsException(Exception):
    """Raised if a launch file's dependencies cannot be determined."""


class RoslaunchDeps:
    """A launch file's dependencies: ``nodes`` (package, program), ``includes`` (files), ``pkgs`` (packages)."""

    def __init__(
        self,
        nodes: Sequence[tuple[str, str]] | None = None,
        includes: Sequence[str] | None = None,
        pkgs: Sequence[str] | None = None,
    ) -> None:
        self.nodes = list(nodes or ())
        self.includes = list(includes or ())
        self.pkgs = list(pkgs or ())

    def __eq__(self, other: object) -> bool:
        return isinstance(other, RoslaunchDeps) and self._sets() == other._sets()

    def __hash__(self) -> int:
        return hash(self._sets())

    def __repr__(self) -> str:
        return f"nodes: {self.nodes}\nincludes: {self.includes}\npkgs: {self.pkgs}"

    def _sets(self) -> tuple[frozenset[tuple[str, str]], frozenset[str], frozenset[str]]:
        return frozenset(self.nodes), frozenset(self.includes), frozenset(self.pkgs)


def roslaunch_deps(
    files: Sequence[str],
    verbose: bool = False,
    use_test_depends: bool = False,
    ignore_unset_args: bool = False,
) -> tuple[str | None, dict[str, RoslaunchDeps], dict[str, set[str]]]:
    """Return the first file's package, each file's dependencies, and the dependencies missing from package.xml files.

    Raise RoslaunchDepsException if a file or package.xml is invalid.
    """
    try:
        needs = file_needs(files, chosen_packages())
        missing = missing_declarations(needs, tests=use_test_depends)
    except MinirospyError as error:
        raise RoslaunchDepsException(str(error)) from error
    found = {file: RoslaunchDeps(what.nodes, what.includes, what.packages) for file, what in needs.items()}
    return package_of(files[0]), found, {package: set(names) for package, names in missing.items()}


def parse_launch(launch_file: str, file_deps: dict[str, RoslaunchDeps], verbose: bool) -> None:
    """Add the dependencies of a launch file and the files that it includes to ``file_deps``.

    Raise RoslaunchDepsException if a file is invalid.
    """
    if verbose:
        print(f"processing launch {launch_file}")
    try:
        needs = file_needs([launch_file], chosen_packages())
    except MinirospyError as error:
        raise RoslaunchDepsException(str(error)) from error
    for file, what in needs.items():
        if verbose and file != launch_file:
            print(f"processing included launch {file}")
        file_deps[file] = RoslaunchDeps(what.nodes, what.includes, what.packages)


def rl_file_deps(file_deps: dict[str, RoslaunchDeps], launch_file: str, verbose: bool = False) -> None:
    """Add a launch file's dependencies; same as :func:`parse_launch`."""
    parse_launch(launch_file, file_deps, verbose)


def fullusage() -> None:
    """Print the usage of `roslaunch-deps`."""
    print(f"Usage:\n\t{NAME} [options] <file-or-package>\n")


def print_deps(base_pkg: object, file_deps: Mapping[str, RoslaunchDeps], verbose: bool) -> None:
    """Print the packages that launch files need, on one line.

    If ``verbose``, print each program and file before that line.
    """
    if verbose:
        for file, deps in file_deps.items():
            for package, program in deps.nodes:
                print(f"{package} [{package}/{program}]")
            package_name = package_of(file)
            if package_name is None:
                print(f"ERROR: cannot determine package for [{package_name}]", file=sys.stderr)
            else:
                print(f"{package_name} [{file}]")
        print("-" * 80)
    print(" ".join({package for deps in file_deps.values() for package in deps.pkgs}))


def calculate_missing(
    base_pkg: object,
    missing: dict[str, set[str]],
    file_deps: Mapping[str, RoslaunchDeps],
    use_test_depends: bool = False,
) -> dict[str, set[str]]:
    """Add to ``missing`` the packages that launch files need but package.xml does not declare; return ``missing``."""
    for file, deps in file_deps.items():
        package = package_of(file)
        if package is None:
            print(f"ERROR: cannot determine package for [{package}]", file=sys.stderr)
            continue
        needs = FileNeeds(tuple(deps.nodes), tuple(deps.includes), tuple(deps.pkgs))
        found = missing_declarations({file: needs}, tests=use_test_depends)
        missing.setdefault(package, set()).update(found.get(package, ()))
    return missing
