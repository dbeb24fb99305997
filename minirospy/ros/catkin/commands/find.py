"""catkin_find, catkin_find_pkg and catkin_topological_order: find catkin's folders, files and packages.

Source: http://docs.ros.org/api/catkin/html. The output is identical to catkin's; packages that do not depend on each other
are sorted by name.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

from minirospy.base.errors import MinirospyError, NotFoundError, UsageError
from minirospy.command.parser import Parser
from minirospy.command.verbs import Command
from minirospy.workspace.build_order import build_order
from minirospy.workspace.dependencies import CircularDependencyError
from minirospy.workspace.manifest import read_manifest
from minirospy.workspace.packages import Packages, built_in_roots

__all__ = [
    "FIND",
    "FIND_PKG",
    "TOPOLOGICAL_ORDER",
    "catkin_find",
    "catkin_find_pkg",
    "catkin_topological_order",
]

_PLACES: dict[str, Callable[[str], str]] = {
    "bin": lambda project: "bin",
    "etc": lambda project: f"etc/{project}",
    "include": lambda project: f"include/{project}",
    "lib": lambda project: "lib",
    "libexec": lambda project: f"lib/{project}",
    "share": lambda project: f"share/{project}",
}
"""Maps each kind of folder to a function that returns a package's path, relative to a devel or install folder."""

_WITHOUT_PROJECT = ("bin", "etc", "include", "lib", "share")
_WITH_PROJECT = ("etc", "include", "libexec", "share")


def catkin_find(argv: Sequence[str] | None = None) -> int:
    """Run the command; return an exit status as defined in minirospy.command.command."""
    return FIND.main(argv)


def catkin_find_pkg(argv: Sequence[str] | None = None) -> int:
    """Run the command. As in catkin, return 2 if the package does not exist."""
    return FIND_PKG.main(argv)


def catkin_topological_order(argv: Sequence[str] | None = None) -> int:
    """Run the command; return an exit status as defined in minirospy.command.command."""
    return TOPOLOGICAL_ORDER.main(argv)


def _find_parser() -> Parser:
    parser = Parser(
        "catkin_find", "Print the folders and files of a package in the workspaces that are sourced."
    )
    add = parser.add_argument
    add(
        "package",
        nargs="?",
        default="",
        help="the package; without one, the folders themselves",
        completer="package_names",
    )
    add("path", nargs="?", default="", help="a file or folder in it", completer="package_path")
    add("--first-only", action="store_true", help="only what is found first")
    add("--without-underlays", action="store_true", help="end with the first workspace that has it")
    for name in _PLACES:
        add(f"--{name}", dest="places", action="append_const", const=name, help=f'search in "{name}"')
    return parser


def _find(
    package: str, path: str, first_only: bool, without_underlays: bool, places: Sequence[str] | None
) -> None:
    known = _WITH_PROJECT if package else _WITHOUT_PROJECT
    chosen = [name for name in _PLACES if name in (places or ())]
    odd = [name for name in chosen if name not in known]
    if odd:
        which = "for a package" if package else "without a package"
        raise UsageError(f"no search {which} in {', '.join(odd)}")
    for workspace in _workspaces():
        found = list(_found(workspace, chosen or known, package, path))
        if first_only:
            del found[1:]
        for each in found:
            print(each)
        if found and (first_only or without_underlays):
            break


def _workspaces() -> Iterator[Path | None]:
    """Yield the sourced workspaces' prefixes, topmost overlay first, then None for minirospy's own packages."""
    for prefix in os.environ.get("CMAKE_PREFIX_PATH", "").split(os.pathsep):
        if prefix and Path(prefix, ".catkin").is_file():
            yield Path(prefix)
    yield None


def _found(workspace: Path | None, places: Sequence[str], project: str, path: str) -> Iterator[Path]:
    if workspace is not None:
        for place in places:
            yield from filter(Path.exists, [workspace / _PLACES[place](project) / path])
        text = (workspace / ".catkin").read_text(encoding="utf-8")
        sources = [Path(each) for each in text.split(";") if each]
    else:
        sources = list(built_in_roots())
    if project and "share" in places:
        try:
            yield from filter(Path.exists, [Packages.below(*sources).find(project) / path])
        except NotFoundError:
            return


def _find_pkg_parser() -> Parser:
    parser = Parser("catkin_find_pkg", "Print where a package is, below a folder.")
    parser.add_argument("pkg", help="the package's name", completer="package_names")
    parser.add_argument(
        "directory", nargs="?", default=".", help="the folder to search (default: .)", completer="folders"
    )
    return parser


def _find_pkg(pkg: str, directory: str) -> int:
    base = Path(directory)
    folder = Packages.below(base).folders().get(pkg)
    if folder is None:
        print(f"Could not find package '{pkg}'.", file=sys.stderr)
        return 2
    print(os.path.relpath(folder, base))
    return 0


def _topological_order_parser() -> Parser:
    parser = Parser(
        "catkin_topological_order", "Print the packages below a folder in the order to build them in."
    )
    parser.add_argument(
        "workspace", nargs="?", default=".", help="the folder (default: .)", completer="folders"
    )
    only = parser.add_mutually_exclusive_group()
    only.add_argument("--only-folders", action="store_true", help="print their folders")
    only.add_argument("--only-names", action="store_true", help="print their names")
    return parser


def _topological_order(workspace: str, only_folders: bool, only_names: bool) -> None:
    base = Path(workspace)
    if not base.is_dir():
        raise MinirospyError(f'Workspace "{base}" does not exist')
    folders = Packages.below(base).folders()
    for name in _ordered(folders):
        folder = os.path.relpath(folders[name], base)
        print(folder if only_folders else name if only_names else f"{name} {folder}")


def _ordered(folders: Mapping[str, Path]) -> list[str]:
    try:
        return build_order({name: read_manifest(folder) for name, folder in folders.items()})
    except CircularDependencyError as error:
        circle = " -> ".join(error.circle)
        raise MinirospyError(f"packages depend on each other in a circle: {circle}") from error


FIND = Command("catkin_find", _find_parser, _find)
FIND_PKG = Command("catkin_find_pkg", _find_pkg_parser, _find_pkg)
TOPOLOGICAL_ORDER = Command("catkin_topological_order", _topological_order_parser, _topological_order)
