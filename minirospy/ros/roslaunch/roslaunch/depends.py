"""roslaunch.depends: the dependencies of launch files."""

from __future__ import annotations

from collections.abc import Sequence

from minirospy.base.errors import MinirospyError
from minirospy.ros.roslaunch.commands.roslaunch_deps import main as roslaunch_deps_main
from minirospy.ros.roslaunch.launcher.depends import file_needs, missing_declarations, package_of
from minirospy.ros.roslaunch.roslaunch.substitution_args import chosen_packages

__all__ = ["NAME", "RoslaunchDeps", "RoslaunchDepsException", "roslaunch_deps", "roslaunch_deps_main"]

NAME = "roslaunch-deps"


class RoslaunchDepsException(Exception):
    """The dependencies of a launch file cannot be determined."""


class RoslaunchDeps:
    """The dependencies of a launch file: ``nodes`` (package, program), ``includes`` (files), ``pkgs`` (packages)."""

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
    """Return the first file's package, each file's dependencies, and, by package, those that its package.xml does not declare.

    Raise RoslaunchDepsException if a file or package.xml is invalid.
    """
    try:
        needs = file_needs(files, chosen_packages())
        missing = missing_declarations(needs, tests=use_test_depends)
    except MinirospyError as error:
        raise RoslaunchDepsException(str(error)) from error
    found = {file: RoslaunchDeps(what.nodes, what.includes, what.packages) for file, what in needs.items()}
    return package_of(files[0]), found, {package: set(names) for package, names in missing.items()}
